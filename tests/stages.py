#!/usr/bin/env python3
"""Stages that change the scheme: what one leaves, the next takes up, and a state of rest stays one.

    stages.py --peat build/peat --case NAME [--ranks N] [--keep DIR]
    stages.py --list quick|full
"""
import sys

import scene_tools


def fields(points):
    return {name: points[name] for name in ("pressure", "effective stress", "displacement")}


def difference(a, b, name):
    """Largest difference of a field between two sets of points in the same order, over its largest value."""
    scale = max(abs(v) for row in a[name] for v in row)
    return max(abs(p - q) for r, s in zip(a[name], b[name]) for p, q in zip(r, s)) / (scale or 1.)


def chain(c, scene, schemes, **settings):
    """A static stage, then the schemes one after the other for a moment each; points at each end."""
    raise NotImplementedError


CASES = {}

if __name__ == "__main__":
    sys.exit(scene_tools.main(CASES, __doc__))
