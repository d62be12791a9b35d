#!/usr/bin/env python3
"""Run the scenes of prm/verification with implicit dynamics of material points.

    implicit_points.py --peat build/peat --case NAME [--ranks N] [--keep DIR]
    implicit_points.py --list quick|full

Bounds are those of the scenes' parameter files, where they are explained; a bound that differs says why beside it.
"""
from math import pi, sqrt
import sys

import scene_tools
from scene_tools import amplitude, fit_decay
from scenes import S1_RATE, d5_eigenvalues, frequency_error

IMPLICIT = {"Scheme": "implicit"}
STEP = "Implicit solver/Time step"


def s1(c):
    """The energy lost is that of the time integration, 1 - |R|^2 = 2 (g w dt)^4 for each step; none is put in."""
    for basis, v0, n in (("gimp", 0.01, 100), ("gimp", 0.1, 100), ("q1", 0.01, 100)):
        run = c.run("S1_bar_mode", dict(IMPLICIT, **{"Explicit MPM/Basis": basis, "Constants/v0": v0, STEP: "T/%d" % n}))
        name = "%s, v0 = %g: " % (basis, v0)
        s = run.table("statistics.csv")
        t, momentum, m = s["time"], s["momentum x"], len(s["time"]) // 4
        loss = 1. - amplitude(t[-m:], momentum[-m:], S1_RATE) / amplitude(t[:m], momentum[:m], S1_RATE)
        energy = [k + e for k, e in zip(s["kinetic energy"], s["elastic energy"])]
        c.below(name + "frequency", abs(frequency_error(run)), 3e-4)
        c.below(name + "amplitude lost in three periods", loss, 5e-3)
        c.below(name + "energy that appears", max(b / a - 1. for a, b in zip(energy, energy[1:])), 1e-6)
        c.below(name + "velocity, L2", run.error("velocity", "L2"), 5e-3)
        c.below(name + "balance of momentum", run.summary["balance"]["momentum"], 1e-7)
    # The time's own: halved steps on one mesh, points that stay in their cells.
    runs = [c.run("S1_bar_mode", dict(IMPLICIT, **{"Explicit MPM/Basis": "q1", "Constants/v0": 1e-3, "Constants/End": "T", STEP: "T/%d" % n,
                                                 "Output/Statistics interval": "T/50", "References/velocity/Times": "T"}))
            for n in (50, 100, 200, 400)]
    v = [r.table("probes.csv")["end/velocity x"] for r in runs]
    differences = [max(abs(a - b) for a, b in zip(p, q)) for p, q in zip(v, v[1:])]
    c.order("velocity of the end, halved steps", (1, 2, 4), differences, 1.9)


def spin(points):
    """Angular momentum about the centre of mass."""
    m = [v[0] for v in points["mass"]]
    M = sum(m)
    mean = lambda name, d: sum(a * v[d] for a, v in zip(m, points[name])) / M
    x, y, u, v = (mean(name, d) for name in ("position", "velocity") for d in (0, 1))
    return sum(a * ((p[0] - x) * (q[1] - v) - (p[1] - y) * (q[0] - u))
               for a, p, q in zip(m, points["position"], points["velocity"]))


def rotation(c):
    """A body that flies and turns: both are linear in place, so neither projection nor basis takes anything of them."""
    lost = []
    for n in (50, 100, 200):
        run = c.run("S5_rigid_motion", dict(IMPLICIT, **{"Constants/omega": 6.2831853, STEP: "1/%d" % n}))
        s = run.table("statistics.csv")
        energy = [k + e for k, e in zip(s["kinetic energy"], s["elastic energy"])]
        lost.append(1. - spin(run.points("block")) / spin(run.points("block", 0)))
        c.report("%d steps a turn: energy lost" % n, "%.2e" % (1. - energy[-1] / energy[0]))
        c.below("%d steps a turn: balance of momentum" % n, run.summary["balance"]["momentum"], 1e-6)
    c.order("angular momentum lost in a turn", (1, 2, 4), lost, 1.8)
    c.below("at 200 steps a turn", abs(lost[-1]), 5e-3)


def d5(c, sizes=(20, 40, 80)):
    for form, inertia in (("up", "true"), ("up0", "false")):
        exact, errors = d5_eigenvalues(form), []
        for n in sizes:
            run = c.run("D5_standing_wave", dict(IMPLICIT, **{
                "Constants/cells": n, STEP: 1e-3 / n, "Seepage inertia": inertia, "Output/Statistics interval": 2e-4}))
            p = run.table("probes.csv")
            errors.append([abs(a / b - 1.) for a, b in zip(fit_decay(p["time"], p["middle/velocity y"], exact), exact)])
        c.below(form + ": imaginary part at 40 cells a wave length", errors[0][1], 2e-3)
        c.below(form + ": real part", errors[0][0], 2e-2)
        c.order(form + ": imaginary part, cells and steps", sizes, [e[1] for e in errors], 1.8)
        # Time alone.
        runs = [c.run("D5_standing_wave", dict(IMPLICIT, **{STEP: "End/%d" % n, "Seepage inertia": inertia,
                                                          "Output/Statistics interval": "End/75"}))
                for n in (150, 300, 600, 1200)]
        for field in "base/pressure", "middle/velocity y":
            v = [r.table("probes.csv")[field] for r in runs]
            differences = [max(abs(a - b) for a, b in zip(p, q)) for p, q in zip(v, v[1:])]
            c.order("%s: %s, halved steps" % (form, field), (1, 2, 4), differences, 1.8)


def d3(c, sizes=(20, 40, 80)):
    runs = [c.run("D3_ramp", dict(IMPLICIT, **{"Constants/cells": n})) for n in sizes]
    c.below("pressure (rms over cells, all times)", runs[-1].error("pressure", "L2"), 1e-2)
    c.below("pressure at the base, Linf", runs[-1].error("pressure at the base", "Linf"), 1e-2)
    c.below("displacement of the top for t >= 0.1 s, Linf", runs[-1].error("displacement of the top", "Linf"), 1e-2)
    fixed = [c.run("D3_ramp", dict(IMPLICIT, **{"Constants/cells": n, STEP: 1e-3 * 20. / n})) for n in sizes]
    for i, t in ((1, 0.1), (2, 0.2), (3, 0.4)):
        c.order("pressure at %g s, cells and steps" % t, sizes, [r.errors_at_times("pressure")[i] for r in fixed], 1.8)
    for run in (runs[-1], fixed[-1]):
        c.below("energy balance", run.summary["balance"]["energy"], 1e-2)
        c.below("fluid mass", run.summary["balance"]["fluid_mass"], 1e-9)
        c.below("momentum", run.summary["balance"]["momentum"], 1e-7)


def d2(c):
    run = c.run("D2_step", IMPLICIT)
    for name in ("pressure at the base", "pressure in the middle", "displacement of the top"):
        c.below(name + ", L1", run.error(name, "L1"), 5e-2)


def p1(c):
    """The full equations in steps far longer than waves take: the steps of a consolidation."""
    run = c.run("P1_terzaghi", IMPLICIT)
    c.below("pressure (rms over cells, all times)", run.error("pressure", "L2"), 3e-3)
    c.below("settlement, Linf", run.error("settlement", "Linf"), 5e-3)
    c.below("steps (explicit: 2e5)", run.summary["steps"], 600)


def fill(c):
    """The last cell of a column filled by less and less: neither the result nor the effort of the linear solver knows."""
    for basis in "gimp", "q1":
        found = []
        for part in (1., 0.1, 1e-2, 1e-4, 1e-6):
            run = c.run("D3_ramp", dict(IMPLICIT, **{
                "Constants/cells": 20, "Explicit MPM/Basis": basis, "Linear solver/Method": "iterative",
                "Bodies/column/Shape": "box(0, 0, h, H - h + %g*h)" % part, "Probes/top/Point": "h/2, H - h", "Constants/End": 0.1, STEP: 1e-3,
                "References/pressure/Times": 0.1, "References/pressure/Columns": "p(t=0.1 s) [Pa]",
                "References/displacement of the top/Start": 0}))
            work = run.summary["iterations"]
            found.append(work["linear"] / work["linear_systems"])
            c.report("%s, filled by %g: iterations a system" % (basis, part), "%.1f" % found[-1])
            c.report("%s, filled by %g: pressure at the base" % (basis, part),
                     "%.2f" % run.table("probes.csv")["base/pressure"][-1])
        c.below(basis + ": iterations, most over those of the full cell", max(found) / found[0], 1.5)


def flat(c):
    """The third dimension must not take part."""
    step = {"Constants/cells": 20, "Constants/End": 0.1, STEP: 1e-3, "References/pressure/Times": "0.03, 0.1",
            "References/pressure/Columns": "p(t=0.03 s) [Pa], p(t=0.1 s) [Pa]",
            "References/displacement of the top/Start": 0}
    two = c.run("D3_ramp", dict(IMPLICIT, **step))
    three = c.run("D3_ramp_3d", dict(IMPLICIT, **step))
    for a, b, t in zip(three.errors_at_times("pressure"), two.errors_at_times("pressure"), (0.03, 0.1)):
        c.below("error of the pressure at %g s against 2-D" % t, abs(a / b - 1.), 1e-5)


def parallel(c):
    cases = {"D3_ramp": {"Constants/cells": 20, "Constants/End": 0.1, STEP: 1e-3, "References/pressure/Times": "0.03, 0.1",
                         "References/pressure/Columns": "p(t=0.03 s) [Pa], p(t=0.1 s) [Pa]",
                         "References/displacement of the top/Start": 0},
             "S5_rigid_motion": {"Constants/omega": 6.2831853, STEP: "1/50", "Output/Pictures": "false"}}
    for scene, settings in cases.items():
        runs = [c.run(scene, dict(IMPLICIT, **settings), ranks=n) for n in c.rank_counts]
        for n, run in zip(c.rank_counts[1:], runs[1:]):
            difference, column = scene_tools.compare_tables(runs[0].directory + "/statistics.csv", run.directory + "/statistics.csv")
            c.below("%s, %d ranks (%s)" % (scene, n, column), difference, 1e-7)


# name: (function, labels, seconds on one core)
CASES = {
    "implicit_S1": (s1, ("full",), 60),
    "implicit_rotation": (rotation, ("full",), 60),
    "implicit_D2": (d2, ("full",), 30),
    "implicit_D3": (d3, ("full",), 60),
    "implicit_D5": (d5, ("full",), 60),
    "implicit_P1": (p1, ("quick", "full"), 5),
    "implicit_fill": (fill, ("full",), 30),
    "implicit_flat": (flat, ("full",), 20),
    "parallel_implicit_points": (parallel, ("full",), 30),
}

if __name__ == "__main__":
    sys.exit(scene_tools.main(CASES, __doc__))
