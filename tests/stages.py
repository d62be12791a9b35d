#!/usr/bin/env python3
"""Stages that change the scheme: what one leaves, the next takes up, and a state of rest stays one.

    stages.py --peat build/peat --case NAME [--ranks N] [--keep DIR]
    stages.py --list quick|full
"""
import sys

import scene_tools


FIELDS = ("pressure", "effective stress", "displacement")
SPEED = 1664.5   # c_u of G1_static.prm [m/s]


def by_number(points, name):
    return {round(number): value for (number,), value in zip(points["id"], points[name])}


def change(before, after, name, scale):
    """Largest change of a field of points."""
    a, b = by_number(before, name), by_number(after, name)
    return max(abs(p - q) for number in a for p, q in zip(a[number], b[number])) / scale


def rest(c):
    for basis in "gimp", "q1":
        for first, then in (("explicit", {}), ("semi-implicit", {}),
                            ("explicit", {"Stages/years/Solver": "dynamic", "Stages/years/Scheme": "implicit",
                                          "Stages/years/Duration": "End"}),
                            ("implicit", {"Stages/years/Solver": "dynamic", "Stages/years/Scheme": "explicit",
                                          "Stages/years/Duration": "End/10"})):
            run = c.run("G1_stages", dict(then, **{"Explicit MPM/Basis": basis, "Stages/rest/Scheme": first,
                                                 "Constants/End": "100*0.55*h/c_u"}))
            pictures = [run.points("ground", k) for k in range(3)]
            last = then.get("Stages/years/Scheme", "quasi-static")
            # Displacements over the height, the others over their largest values.
            scales = {name: max(abs(v) for row in pictures[0][name] for v in row) for name in FIELDS}
            scales["displacement"] = 10.
            for k, stage in ((1, first), (2, last)):
                largest = max(change(pictures[k - 1], pictures[k], name, scales[name]) for name in FIELDS)
                c.below("%s, static to %s to %s: change in '%s'" % (basis, first, last, stage), largest, 1e-8)
            c.below("largest speed over c_u", max(run.table("statistics.csv")["largest speed"]) / SPEED, 1e-10)


CASES = {"stages_rest": (rest, ("quick", "full"), 10)}

if __name__ == "__main__":
    sys.exit(scene_tools.main(CASES, __doc__))
