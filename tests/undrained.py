#!/usr/bin/env python3
"""Pore pressures near the undrained limit: what alternates from cell to cell, over permeabilities and Poisson's ratios.

    undrained.py --peat build/peat --case table     all of the table in doc/benchmarks.md, some minutes
    undrained.py --peat build/peat --case NAME       undrained_limit: its corners, as a test
    undrained.py --list quick|full

The strip load of P5 (quasi-static, and in one step of waves that nothing resolves) and the pulse of D6. The measure is the
root mean square over cells of fourth differences of the cells' mean pressures, over 16, in x and in y: that of a pressure
which alternates is its amplitude, that of a smooth one falls with h^4; cells with a stencil that touches the top, where a
drained layer thinner than a cell may be, are left out. It is divided by the largest pressure of the run's end, or by a
hundredth of the load if that is more. It must be below 1 %.
"""
from math import sqrt
import os
import sys

import scene_tools

CONDUCTIVITIES = (1e-1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
RATIOS = (0.3, 0.49, 0.4999)
WITH_PICTURE = {"Output/Pictures": "true", "Output/Interval": 0, "Method": "mpm", "Constants/cells": 4}
# Some hundred steps of the wave in the skeleton, by Poisson's ratio [s].
MOMENT = {0.3: 0.4, 0.49: 0.1, 0.4999: 0.02}
# name: (scene, what it sets)
SCHEMES = {
    "P5, quasi-static": ("P5_strip", {"Constants/End": 10, "Implicit solver/Time step": 1}),
    "P5, semi-implicit": ("P5_strip", {"Stages/consolidation/Solver": "dynamic", "Scheme": "semi-implicit",
                                       "Constants/End": MOMENT}),
    "D6, semi-implicit": ("D6_strip_pulse", {"Scheme": "semi-implicit", "Constants/End": 0.08}),
    "D6, implicit": ("D6_strip_pulse", {"Scheme": "implicit", "Constants/End": 0.08, "Output/Statistics interval": 0.08}),
}
LOAD, CELL = 1e3, 0.25


def cell_means(run):
    points, sums = run.points("layer"), {}
    for x, (p,), (V,) in zip(points["position"], points["pressure"], points["volume"]):
        key = tuple(int(c / CELL) for c in x[:2])
        a, b = sums.get(key, (0., 0.))
        sums[key] = (a + V * p, b + V)
    return {key: a / b for key, (a, b) in sums.items()}


def alternating(p):
    top, squares, n = max(j for _, j in p), 0., 0
    for i, j in p:
        for di, dj in ((1, 0), (0, 1)):
            stencil = [p.get((i + s * di, j + s * dj)) for s in range(-2, 3)]
            if None not in stencil and j + 2 * dj < top:
                squares += (sum(w * v for w, v in zip((1, -4, 6, -4, 1), stencil)) / 16.)**2
                n += 1
    return sqrt(squares / n) / max(max(abs(v) for v in p.values()), 1e-2 * LOAD)


def measure(c, name, k, nu):
    scene, settings = SCHEMES[name]
    # A skeleton as stiff as the fluid is ill-posed with the term.
    inertia = {"Seepage inertia": "false"} if nu > 0.4 else {}
    settings = {key: value[nu] if isinstance(value, dict) else value for key, value in settings.items()}
    # The references are those of other constants.
    plain = os.path.join(os.path.abspath(c.root), scene + ".prm")
    with open(os.path.join(scene_tools.SCENES, scene + ".prm")) as given, open(plain, "w") as file:
        file.write(scene_tools.without(given.read(), "References"))
    run = c.run(plain[:-len(".prm")], dict(WITH_PICTURE, **settings, **inertia, **{"Constants/k": k, "Constants/nu": nu}))
    return alternating(cell_means(run))


def corners(c):
    for name in SCHEMES:
        for k in (1e-3, 1e-12):
            for nu in (0.3, 0.4999):
                c.below("%s, k = %g, nu = %g: alternating pressure" % (name, k, nu), measure(c, name, k, nu), 1e-2)


def table(c):
    for nu in RATIOS:
        print("\n| nu = %g, k [m/s] | %s |" % (nu, " | ".join("%g" % k for k in CONDUCTIVITIES)))
        print("|---|" + "---|" * len(CONDUCTIVITIES))
        for name in SCHEMES:
            values = [measure(c, name, k, nu) for k in CONDUCTIVITIES]
            print("| %s | %s |" % (name, " | ".join("%.1e" % v for v in values)), flush=True)


CASES = {"undrained_limit": (corners, ("full",), 60), "table": (table, (), 600)}

if __name__ == "__main__":
    sys.exit(scene_tools.main(CASES, __doc__))
