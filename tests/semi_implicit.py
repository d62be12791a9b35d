#!/usr/bin/env python3
"""Run the scenes of prm/verification with implicit pore pressures beside the explicit skeleton.

    semi_implicit.py --peat build/peat --case NAME [--ranks N] [--keep DIR]
    semi_implicit.py --list quick|full

Bounds are those of the scenes' parameter files, where they are explained; a bound that differs says why beside it.
"""
import sys

import contact_scenes
import scene_tools
from contact_history import History

IMPLICIT = {"Scheme": "semi-implicit"}
TABLE = "reference/data/D3_ramp_%sup.csv"
PROFILES = "reference/data/D3_ramp_%sprofiles_up.csv"


def ramp(conductivity, table, **constants):
    settings = {"Constants/k": conductivity, "References/pressure/File": PROFILES % table}
    for name in "pressure at the base", "displacement of the top":
        settings["References/%s/File" % name] = TABLE % table
    settings.update(("Constants/" + key, value) for key, value in constants.items())
    return settings


def d3(c):
    # With k = 1e-6 m/s the drained layer is thinner than a cell for ever: nothing is said of the top.
    for k, table in (1e-2, "permeable_"), (1e-3, ""), (1e-6, "tight_"):
        sizes = (20, 40, 80)
        runs = [c.run("D3_ramp", dict(IMPLICIT, **ramp(k, table, cells=n))) for n in sizes]
        c.below("k = %g: pressure (rms over cells, all times)" % k, runs[-1].error("pressure", "L2"), 1e-2)
        c.below("k = %g: pressure at the base, Linf" % k, runs[-1].error("pressure at the base", "Linf"), 1e-2)
        if k > 1e-6:
            c.below("k = %g: displacement of the top for t >= 0.1 s, Linf" % k,
                    runs[-1].error("displacement of the top", "Linf"), 1e-2)
            c.order("k = %g: pressure at 0.4 s" % k, sizes, [r.errors_at_times("pressure")[-1] for r in runs], 1.8)
        # 0.8 h/c_hf with the allowance for slivers, whatever the permeability; the explicit step needs 170,000, 17,000 and 7,000.
        c.below("k = %g: steps" % k, runs[-1].summary["steps"], 1250)
        c.below("k = %g: fluid mass" % k, runs[-1].summary["balance"]["fluid_mass"], 1e-12)
        c.below("k = %g: momentum" % k, runs[-1].summary["balance"]["momentum"], 1e-12)


def d3_3d(c):
    """The third dimension must not take part, nor may the basis and the stress update matter much."""
    short = {"References/pressure/Times": "0.03, 0.1, 0.2",
             "References/pressure/Columns": "p(t=0.03 s) [Pa], p(t=0.1 s) [Pa], p(t=0.2 s) [Pa]", "Constants/End": 0.2}
    flat = c.run("D3_ramp", dict(IMPLICIT, **{"Constants/cells": 20}, **short))
    run = c.run("D3_ramp_3d", IMPLICIT)
    for a, b, t in zip(run.errors_at_times("pressure"), flat.errors_at_times("pressure"), (0.03, 0.1, 0.2)):
        c.below("error of the pressure at %g s against 2-D" % t, abs(a / b - 1.), 1e-6)
    for update in "usl", "musl":
        run = c.run("D3_ramp_3d", dict(IMPLICIT, **{"Explicit MPM/Basis": "q1", "Explicit MPM/Stress update": update}))
        # The step of q1 is longer than that of gimp, 25 a rise of the load: 2 % is the error of the trapezoidal rule.
        c.below("q1, %s: pressure at the base, Linf" % update, run.error("pressure at the base", "Linf"), 3e-2)


def d5(c):
    """Order in time, of a wave that steps resolve: differences between runs with halved steps on one mesh."""
    for form in "true", "false":
        runs = [c.run("D5_standing_wave", dict(IMPLICIT, **{
            "Explicit MPM/Time step": "End/%d" % n, "Output/Probe interval": "End/600", "Seepage inertia": form}))
                for n in (600, 1200, 2400, 4800)]
        pressures = [r.table("probes.csv")["base/pressure"] for r in runs]
        scale = max(abs(p) for p in pressures[-1])
        differences = [max(abs(a - b) for a, b in zip(p, q)) / scale for p, q in zip(pressures, pressures[1:])]
        c.order("seepage inertia %s: pressure, steps" % form, (1, 2, 4), differences, 1.7)
        c.below("difference to the explicit scheme", explicit_difference(c, pressures[-1], scale, form), 1e-2)


def explicit_difference(c, pressures, scale, form):
    run = c.run("D5_standing_wave", {"Explicit MPM/Step factor": 0.1, "Output/Probe interval": "End/600",
                                     "Seepage inertia": form})
    return max(abs(a - b) for a, b in zip(run.table("probes.csv")["base/pressure"], pressures)) / scale


def p1(c):
    sizes = (10, 20, 40)
    runs = [c.run("P1_terzaghi", dict(IMPLICIT, **{"Constants/cells": n})) for n in sizes]
    c.below("pressure (rms over cells, all times)", runs[-1].error("pressure", "L2"), 3e-3)
    c.below("settlement, Linf", runs[-1].error("settlement", "Linf"), 5e-3)
    for i, T in ((1, 0.1), (2, 0.2)):
        c.order("pressure at T = %g" % T, sizes, [r.errors_at_times("pressure")[i] for r in runs], 1.8)


def rest(c):
    run = c.run("P2_selfweight_consolidation", dict(IMPLICIT, **{
        "Constants/H": 1, "Constants/cells": 10, "Constants/K_f": 2.2e8, "Constants/g": 1e-3, "Constants/End": "7*t_1"}))
    c.below("pressure in the end, hydrostatic", run.error("hydrostatic", "Linf"), 1e-6)
    for offset in (0, 0.37):
        run = c.run("G1_rest", dict(IMPLICIT, **{"Constants/offset": offset}))
        c.below("offset %g: displacement over height" % offset, run.error("displacement", "Linf"), 1e-6)
        c.below("offset %g: pressure" % offset, run.error("pressure", "Linf"), 1e-6)
    for scene in "G1_static", "G2_layered_slope":
        run = c.run(scene, IMPLICIT)
        speed = max(run.table("statistics.csv")["largest speed"])
        c.below(scene + ": largest speed over c_u", speed / 1664.5, 1e-15)


def limit(c):
    """In permeable soil the largest step is h/c_hf; the automatic one also allows for slivers, by a factor of sqrt(3)."""
    for share, stable in (0.97, True), (1.04, False):
        run = c.run("N1_timestep", dict(IMPLICIT, **{
            "Constants/k": 1e-2, "Constants/End": 3, "Output/Statistics interval": 3,
            "Explicit MPM/Step factor": share * 3.**0.5}), may_fail=True)
        speed = run.table("statistics.csv")["largest speed"]
        # It begins with 1e-6 m/s, and is damped.
        c.note("step %g h/c_hf is %s" % (share, "stable" if stable else "unstable"), (speed[-1] < 1e-6) == stable,
               "speed in the end %.3g m/s" % speed[-1])


def parallel_pressure(c):
    tight = dict(IMPLICIT, **{"Explicit MPM/Pressure tolerance": 1e-14})
    cases = {"D3_ramp": dict(tight, **ramp(1e-2, "permeable_", cells=40)), "D6_strip_pulse": dict(tight, **{"Method": "mpm", "Constants/cells": 2})}
    for scene, settings in cases.items():
        runs = [c.run(scene, settings, ranks=n) for n in (1, 2, 3)]
        for n, run in zip((2, 3), runs[1:]):
            for table in "statistics.csv", "probes.csv":
                difference, column = scene_tools.compare_tables(runs[0].directory + "/" + table, run.directory + "/" + table)
                c.below("%s, %d ranks, %s (%s)" % (scene, n, table[:-4], column), difference, 1e-10)


class Implicit:
    """A context all runs of which have implicit pressures."""

    def __init__(self, context, **settings):
        self.context, self.settings = context, dict(IMPLICIT, **settings)

    def run(self, scene, settings=None, **options):
        return self.context.run(scene, dict(settings or {}, **self.settings), **options)

    def __getattr__(self, name):
        return getattr(self.context, name)


def i2(c):
    """A free rigid body on a column, with the scenes' own bounds."""
    c = Implicit(c)
    for k in 1e-12, 1e-5:
        run, v_error, f_error = contact_scenes.i2_errors(c, "I2_rigid_on_column", k, 80, {}, lambda h: h)
        c.below("k = %g: velocity" % k, v_error, 2e-2)
        c.below("k = %g: force" % k, f_error, 4e-2)
        c.below("k = %g: momentum" % k, run.summary["balance"]["momentum"], 1e-12)
    contact_scenes.i2_3d(c)
    # A step in which the undrained wave passes four cells: what the block keeps of its velocity, to what the exact one loses in
    # two steps; energy and momentum as ever.
    long = {"Output/Statistics interval": "4*h/c_u"}
    run, v_error, _ = contact_scenes.i2_errors(c, "I2_rigid_on_column", 1e-12, 80, long, lambda h: h)
    s = History(run, "impact")
    energy = s.energy()
    c.below("long steps: velocity", v_error, 0.15)
    c.below("long steps: steps", run.summary["steps"], 70)
    c.below("long steps: growth of energy", max(energy) / energy[0] - 1., 1e-3)
    c.below("long steps: momentum", run.summary["balance"]["momentum"], 1e-12)


def i1(c):
    """An elastic, dry bar: it shares its nodes with the reactions."""
    contact_scenes.i1_3d(Implicit(c))


def c4(c):
    # Steps 14 times as long as explicit ones. That the points at the base begin to reach over a face of the mesh excites the
    # gravest undrained wave more than in explicit steps, and it fades slowly.
    contact_scenes.c4(Implicit(c), 2e-2)


def against_explicit(c):
    """Two-dimensional impacts of which only balances are exact: else what explicit steps of the same length find."""
    for scene, settings in (("I3_block_drop", {"Constants/End": 0.02}), ("I3_saturated_discs", {"Constants/cells": 5})):
        found = {}
        for scheme in "explicit", "semi-implicit":
            run = c.run(scene, dict(settings, **{"Scheme": scheme, "Output/Pictures": "false"}))
            found[scheme] = History(run, "impact")
            c.below("%s, %s: momentum" % (scene, scheme), run.summary["balance"]["momentum"], 1e-12)
        s, known = found["semi-implicit"], found["explicit"]
        width = 20. * (known.t[1] - known.t[0])
        largest = [max(f for _, f in history.averaged(width)) for history in (s, known)]
        # A mean over twenty lines of statistics of single nodes that touch; the discs have few of them.
        c.below(scene + ": largest force", abs(largest[0] / largest[1] - 1.), 2e-2 if scene == "I3_block_drop" else 5e-2)
        c.below(scene + ": impulse", abs(s.impulse[-1] / known.impulse[-1] - 1.), 2e-2)
        c.below(scene + ": penetration against explicit", s.deepest() / known.deepest() - 1., 5e-2)
        energy = [e + d for e, d in zip(s.energy(), s.table["seepage dissipation"])]
        if scene == "I3_saturated_discs":
            c.below(scene + ": growth of energy with what seepage took", max(energy) / energy[0] - 1., 1e-3)


def contact_rest(c):
    """An elastic block on saturated ground, at rest: nothing moves but for the sites' weights against the static state."""
    path = contact_scenes.variant(c, "I3_block_drop", "resting",
                                  lambda text: text.replace("    set From stage       = impact\n", ""))
    speeds = {}
    for scheme in "explicit", "semi-implicit":
        run = c.run(path, {"Scheme": scheme, "Constants/v0": 0, "Constants/Gap": 0, "Constants/cells": 12, "Constants/E_b": 3e8,
                           "Constants/End": 0.05, "Output/Statistics interval": "End/25", "Output/Pictures": "false"})
        s = run.table("statistics.csv")
        speeds[scheme] = max(s["largest speed"])
        weight = 2400. * 0.5 * 0.75 * 9.81
        force = sum(s["impact/normal force"][1:]) / (len(s["time"]) - 1)
        c.below(scheme + ": mean force against the weight", abs(force / weight - 1.), 2e-2)
        c.report(scheme + ": largest speed [m/s], steps", "%.3g, %d" % (speeds[scheme], run.summary["steps"]))
    c.below("largest speed against that of explicit steps", speeds["semi-implicit"] / speeds["explicit"], 2.)


def contact_parallel(c):
    tight = dict(IMPLICIT, **{"Explicit MPM/Pressure tolerance": 1e-14, "Output/Pictures": "false"})
    cases = {"I2_3d": {"Constants/cells": 10}, "I3_block_drop": {"Constants/cells": 12, "Constants/offset": 0.37, "Constants/End": 0.004}}
    for scene, settings in cases.items():
        runs = [c.run(scene, dict(tight, **settings), ranks=n) for n in c.rank_counts]
        for n, run in zip(c.rank_counts[1:], runs[1:]):
            for table in "statistics.csv", "probes.csv":
                difference, column = scene_tools.compare_tables(runs[0].directory + "/" + table, run.directory + "/" + table)
                # Ranks add up in other orders; impact and the iterations make more of that than steps alone.
                c.below("%s, %d ranks, %s (%s)" % (scene, n, table[:-4], column), difference, 1e-9)


# name: (function, labels, seconds on one core)
CASES = {
    "semi_D3": (d3, ("quick", "full"), 3),
    "semi_D3_3d": (d3_3d, ("quick", "full"), 2),
    "semi_D5": (d5, ("full",), 5),
    "semi_P1": (p1, ("full",), 5),
    "semi_limit": (limit, ("quick", "full"), 2),
    "semi_rest": (rest, ("quick", "full"), 5),
    "parallel_pressure": (parallel_pressure, ("full",), 20),
    "semi_I1_3d": (i1, ("full",), 20),
    "semi_I2": (i2, ("quick", "full"), 3),
    "semi_C4": (c4, ("full",), 15),
    "semi_contact": (against_explicit, ("full",), 20),
    "semi_contact_rest": (contact_rest, ("quick", "full"), 5),
    "semi_contact_parallel": (contact_parallel, ("full",), 20),
}

if __name__ == "__main__":
    sys.exit(scene_tools.main(CASES, __doc__))
