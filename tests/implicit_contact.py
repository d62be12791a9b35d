#!/usr/bin/env python3
"""Run scenes in which rigid bodies act on material points in implicit stages.

    implicit_contact.py --peat build/peat --case NAME [--ranks N] [--keep DIR]
    implicit_contact.py --list quick|full

Bounds are those of the scenes' parameter files, where they are explained; a bound that differs says why beside it.
"""
import os
import sys
from math import cos, exp, pi, radians, sin

import scene_tools
from contact_history import History
from contact_scenes import C_U, i2_errors, slope_of
from scene_tools import compare_tables

IMPLICIT = {"Scheme": "implicit"}
STEP = "Implicit solver/Time step"
OFFSETS = (0.13, 0.37, 0.71)


# -------------------------------------------------------------------------------------------------- consolidation
H, Q_LOAD, E, NU, STORAGE, K, RHO_F, G = 1., 1e3, 1e7, 0.3, 2.2e9 / 0.4, 1e-4, 1e3, 9.81
M = E * (1. - NU) / ((1. + NU) * (1. - 2. * NU))
P0 = Q_LOAD * STORAGE / (M + STORAGE)
C_V = K / (RHO_F * G) / (1. / STORAGE + 1. / M)


def terzaghi_settlement(t, path):
    T = C_V * t / path**2
    return P0 * H / M * (1. - sum(8. / (m * pi)**2 * exp(-(m * pi)**2 * T / 4.) for m in range(1, 400, 2)))


def terzaghi_pressure(t, path, from_drain):
    T = C_V * t / path**2
    return P0 * sum(4. / (m * pi) * sin(m * pi * from_drain / (2. * path)) * exp(-(m * pi)**2 * T / 4.)
                    for m in range(1, 400, 2))


def plate(c, scene, settings, path, name, axis="y", scale=1., closed="top", area_of=lambda h: h):
    run = c.run(scene, settings)
    s, p = History(run, "footing"), run.table("probes.csv")
    h = H / (40 if scene == "P1_rigid_plate" else 20)
    weight = Q_LOAD * area_of(h)
    first = 2  # the first line is the start
    c.below(name + "force of contact against the weight, every step", max(abs(f / weight - 1.) for f in s.force[1:]), 1e-6)
    force = [f for f in s.table["plate/force " + axis]]
    c.below(name + "force on the plate", max(abs(f / weight - 1.) for f in force[1:]), 1e-6)
    settled = [s.table["plate/position " + axis][0] - y for y in s.table["plate/position " + axis]]
    late = [(t, w) for t, w in zip(s.t, settled) if C_V * t / path**2 >= 0.02]
    c.below(name + "settlement, Linf", max(abs(w - terzaghi_settlement(t, path)) for t, w in late) / (Q_LOAD * H / M),
            5e-3 * scale)
    column, from_drain = {"top": ("top/pressure", H), "middle": ("middle/pressure", 0.5 * H)}[closed]
    late = [(t, v) for t, v in zip(p["time"], p[column]) if C_V * t / path**2 >= 0.02]
    c.below(name + "pressure farthest from the drain, Linf",
            max(abs(v - terzaghi_pressure(t, path, from_drain)) for t, v in late) / Q_LOAD, 5e-3 * scale)
    # The points' extents do not follow small strains: a quarter of a cell times q/M.
    c.below(name + "deepest overlap [h]", s.deepest() / h, 0.26 * Q_LOAD / M)
    return run


def p1_plate(c):
    plate(c, "P1_rigid_plate", {}, H, "impermeable: ")
    plate(c, "P1_rigid_plate", {"Contacts/footing/Interface": "drained"}, 0.5 * H, "drained: ", closed="middle")


def p1_plate_more(c):
    for basis in "gimp", "q1":
        for law in "stick", "coulomb":
            settings = {"Contacts/footing/Law": law, "Explicit MPM/Basis": basis}
            if law == "coulomb":
                settings["Contacts/footing/Friction"] = 0.4
            plate(c, "P1_rigid_plate", settings, H, "%s, %s: " % (basis, law))
    plate(c, "P1_rigid_plate", {"Linear solver/Method": "iterative"}, H, "iterative: ")


def p1_plate_3d(c):
    # 20 cells: errors of space are four times those of 40.
    plate(c, "P1_rigid_plate_3d", {}, H, "3-D: ", axis="z", scale=4., area_of=lambda h: h * h)


# ---------------------------------------------------------------------------------------------------- indentation
def indent(c, scene, settings, name, area=1., cells=20, offset=0.):
    run = c.run(scene, settings)
    s = History(run, "indentation")
    h = H / (cells - offset)
    stiffness, d = M / H * area * (h if scene == "C8_indentation" else 2. * h * h), 1e-6 * H
    exact = [stiffness * max(0., d * t if t <= 1. else d * (3. - 2. * t)) for t in s.t]
    c.below(name + "force over M d/H, largest difference", max(abs(f - e) for f, e in zip(s.force, exact)) / (stiffness * d), 1e-5)
    c.note(name + "parts", s.force[-1] == 0. and s.gap[-1] > 0.4 * d, "force %g, gap %g" % (s.force[-1], s.gap[-1]))
    return run


def c8(c):
    indent(c, "C8_indentation", {}, "")


def c8_more(c):
    indent(c, "C8_indentation", {"Explicit MPM/Basis": "q1"}, "q1: ")
    for offset in OFFSETS:
        # Extents of points in cut cells tell the gap within 0.003 h. (Beyond a strain of half a percent they no longer do: those of a
        # law of small strain stay.)
        d, h = 4e-3 * H, H / (20 - offset)
        run = c.run("C8_indentation", {"Constants/offset": offset, "Constants/d": d})
        c.below("offset %g: force over M d/H" % offset, abs(max(History(run, "indentation").force) / (M * d / H * h) - 1.),
                3e-3 * h / d + 1.5 * d / H)


def c8_3d(c):
    indent(c, "C8_3d", {}, "3-D: ", cells=8)


# --------------------------------------------------------------------------------------------------------- friction
def shear(c):
    """Pressed first, then shorn: no slip below mu N, all of it at mu N."""
    run = c.run("C8_shear", {})
    s = run.table("statistics.csv")
    t, normal, along = s["time"], [abs(f) for f in s["shearing/normal force"]], [abs(f) for f in s["shearing/force x"]]
    ratio = [b / a if a > 0. else 0. for a, b in zip(normal, along)]
    c.below("friction above mu N", max(ratio) / 0.3 - 1., 1e-9)
    c.below("in the end: |T|/(mu N) - 1", abs(ratio[-1] / 0.3 - 1.), 1e-9)
    sticking = [(a, b) for a, b, r in zip(t, along, ratio) if 1. < a and r < 0.05]
    c.note("sticks at first", len(sticking) > 1, "%d lines" % len(sticking))
    energy = s["contact dissipation"]
    c.below("dissipation falls", max(a - b for a, b in zip(energy, energy[1:])) / energy[-1], 1e-9)
    c.note("dissipation of sliding", energy[-1] > 0., "%g J" % energy[-1])


def incline(c):
    """A free rigid plate on an elastic block under tilted gravity, dynamic."""
    g, theta = 9.81, radians(30.)
    for mu in (0.3, 0.):
        run = c.run("C3_rigid_block", {"Constants/mu": mu})
        s = run.table("statistics.csv")
        late = [(a, b) for a, b in zip(s["time"], s["plate/velocity x"]) if a > 0.1]
        exact = g * (sin(theta) - mu * cos(theta))
        c.below("mu = %g: acceleration" % mu, abs(slope_of(*zip(*late)) / exact - 1.), 5e-3)
    run = c.run("C3_rigid_block", {"Constants/mu": 0.7})
    s = run.table("statistics.csv")
    c.below("mu = 0.7: drift over the way without friction", abs(s["plate/position x"][-1] - s["plate/position x"][0]) /
            (0.5 * g * sin(theta) * s["time"][-1]**2), 1e-3)


# ------------------------------------------------------------------------------------------------------------ impact
def i2(c):
    """Steps in which the undrained wave passes a quarter of a cell follow the front. Consistent masses blur it over some cells, where
    the force comes up to the exact one: 5 % are missing after three cells, a tenth of a percent after twenty."""
    for k in (1e-12, 1e-5, 1e-4, 1e-3):
        settings = dict(IMPLICIT, **{STEP: "0.25*h/c_u"})
        run, v_error, f_error = i2_errors(c, "I2_rigid_on_column", k, 80, settings, lambda h: h, begin=6.)
        name = "k = %g: " % k
        c.below(name + "velocity", v_error, 2e-2)
        # Without flow nothing damps what rings behind the front.
        c.below(name + "force", f_error, 4e-2 if k > 1e-9 else 6e-2)
        c.below(name + "balance of momentum", run.summary["balance"]["momentum"], 1e-7)


def at(table, column, t):
    """The last value up to a time, and the first one after it."""
    i = max(i for i, u in enumerate(table["time"]) if u <= t * (1. + 1e-9))
    return table[column][i], table[column][i + 1]


def stages(c):
    """Impact, rest and consolidation in one file: the tamper stays on the ground, and nothing jumps between explicit and implicit steps."""
    run = c.run(os.path.join("..", "examples", "tamper_consolidation"), {"Output/Pictures": "false"})
    s, p = run.table("statistics.csv"), run.table("probes.csv")
    change, weight = 0.8, 7850. * 2. * G
    before, after = at(s, "tamper/position y", change)
    depth = s["tamper/position y"][0] - min(s["tamper/position y"])
    c.below("jump of the tamper over its deepest way", abs(after - before) / depth, 1e-2)
    # What is left of the motion is out of balance by as much.
    before, after = at(s, "tamper/force y", change)
    c.below("jump of the force over the weight", abs(after - before) / weight, 1e-2)
    for probe in "below", "deep":
        before, after = at(p, probe + "/pressure", change)
        c.below("jump of the pressure %s over the largest" % probe, abs(after - before) / max(p[probe + "/pressure"]), 1e-2)
    late = [f for t, f in zip(s["time"], s["tamper/force y"]) if t > change * (1. + 1e-9)]
    c.below("force against the weight in each step of the consolidation", max(abs(f / weight - 1.) for f in late), 1e-6)
    c.note("the tamper settles", s["tamper/position y"][-1] < at(s, "tamper/position y", change)[1], "")
    # Hydrostatic pressure in the end, 3 m below the surface.
    c.below("excess pressure that is left, over that of the impact",
            abs(p["deep/pressure"][-1] - 3. * 1e3 * G) / (max(p["deep/pressure"]) - 3. * 1e3 * G), 1e-2)


def no_balance(c):
    """Without friction nothing holds a plate under tilted gravity: that is said, with its name."""
    run = c.run("P1_rigid_plate", {"Gravity": "1e-7, -1e-6", "Rigid bodies/plate/Free components": "x, y", "Constants/cells": 4}, may_fail=True)
    c.note("no equilibrium", run.code == 2 and "rigid body 'plate'" in run.message, run.message[-200:])


def parallel(c):
    cases = {"P1_rigid_plate": {"Constants/cells": 20, "Constants/End": "0.05*t_1"},
             "C8_shear": {"Constants/End": 1.2}, "C3_rigid_block": {"Constants/End": 0.05}}
    for scene, settings in cases.items():
        runs = [c.run(scene, settings, ranks=n) for n in c.rank_counts]
        for n, run in zip(c.rank_counts[1:], runs[1:]):
            difference, column = compare_tables(runs[0].directory + "/statistics.csv", run.directory + "/statistics.csv")
            c.below("%s, %d ranks (%s)" % (scene, n, column), difference, 1e-9)


# name: (function, labels, seconds on one core)
CASES = {
    "implicit_P1_plate": (p1_plate, ("quick", "full"), 4),
    "implicit_P1_plate_more": (p1_plate_more, ("full",), 20),
    "implicit_P1_plate_3d": (p1_plate_3d, ("full",), 20),
    "implicit_C8": (c8, ("quick", "full"), 2),
    "implicit_C8_more": (c8_more, ("full",), 10),
    "implicit_C8_3d": (c8_3d, ("full",), 10),
    "implicit_shear": (shear, ("quick", "full"), 4),
    "implicit_incline": (incline, ("full",), 30),
    "implicit_I2": (i2, ("full",), 60),
    "implicit_tamper": (stages, ("full",), 90),
    "implicit_no_balance": (no_balance, ("full",), 10),
    "parallel_implicit_contact": (parallel, ("full",), 30),
}

if __name__ == "__main__":
    sys.exit(scene_tools.main(CASES, __doc__))
