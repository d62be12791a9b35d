#!/usr/bin/env python3
"""Run scenes of prm/verification by the implicit solvers (u-p finite elements, quasi-static material points, static states)
and hold the results against what is known of them: fem_scenes.py --peat build/peat --case NAME, as scenes.py.
"""
import sys

import scenes
from scenes import compare_tables, d5_eigenvalues, fit_decay

FEM = {"Method": "fem"}
QUASI_STATIC = {"Stages/consolidation/Solver": "quasi-static"}


def with_fem(**constants):
    return dict(FEM, **{"Constants/" + name: value for name, value in constants.items()})


def p1(c, sizes=(10, 20, 40)):
    """Consolidation: elements of both kinds, and material points of both bases."""
    methods = {"taylor-hood": FEM,
               "q1 elements": dict(FEM, **{"Implicit solver/Element": "q1"}),
               "points, gimp": {"Explicit MPM/Basis": "gimp"},
               "points, q1": {"Explicit MPM/Basis": "q1"}}
    for name, settings in methods.items():
        # Tight steps: the order is that of space.
        runs = [c.run("P1_terzaghi", dict(settings, **QUASI_STATIC, **{
            "Constants/cells": n, "Implicit solver/Step tolerance": 1e-5})) for n in sizes]
        c.below(name + ": pressure (rms over cells, all times)", runs[-1].error("pressure", "L2"), 3e-3)
        c.below(name + ": settlement, Linf", runs[-1].error("settlement", "Linf"), 5e-3)
        if name == "taylor-hood":
            c.order(name + ": pressure at T = 0.1", sizes, [r.errors_at_times("pressure")[1] for r in runs], 1.8)
        c.below(name + ": fluid mass", runs[-1].summary["balance"]["fluid_mass"], 1e-6)
    # To the end of consolidation in few steps.
    for name, settings in methods.items():
        run = c.run("P1_terzaghi", dict(settings, **QUASI_STATIC, **{
            "Constants/End": "2*t_1", "References/pressure/Times": "0.02*t_1, 0.1*t_1, 0.2*t_1, 0.5*t_1, t_1",
            "References/pressure/Columns": ", ".join("p(T=%g) [Pa]" % T for T in (0.02, 0.1, 0.2, 0.5, 1))}))
        c.below(name + ": steps to T = 2", run.summary["steps"], 60)
        c.below(name + ": pressure", run.error("pressure", "L2"), 1e-2)
        c.below(name + ": settlement, Linf", run.error("settlement", "Linf"), 1e-2)


def d3(c, sizes=(20, 40, 80)):
    runs = [c.run("D3_ramp", with_fem(cells=n)) for n in sizes]
    c.below("pressure at the base, Linf", runs[-1].error("pressure at the base", "Linf"), 1e-3)
    c.below("displacement of the top for t >= 0.1 s, Linf", runs[-1].error("displacement of the top", "Linf"), 1e-2)
    c.order("pressure at the base", sizes, [r.error("pressure at the base", "L2") for r in runs], 1.8)
    # The drained layer is thinner than a cell at first: before it is resolved the largest error stands there.
    c.order("pressure at 0.4 s", sizes, [r.errors_at_times("pressure")[3] for r in runs], 1.5)
    c.below("fluid mass", runs[-1].summary["balance"]["fluid_mass"], 1e-8)
    c.below("energy", runs[-1].summary["balance"]["energy"], 1e-3)
    run = c.run("D3_ramp", dict(with_fem(cells=80), **{"Implicit solver/Element": "q1"}))
    c.below("q1 elements: pressure (rms, all times)", run.error("pressure", "L2"), 1e-2)
    c.below("q1 elements: pressure at the base, Linf", run.error("pressure at the base", "Linf"), 5e-3)


def d2(c):
    run = c.run("D2_step", FEM)
    for name in ("pressure at the base", "pressure in the middle", "displacement of the top"):
        c.below(name + ", L1", run.error(name, "L1"), 5e-2)


def d5(c):
    """Speed and damping of waves; the order in time of generalised-alpha."""
    for form in ("up", "up0"):
        exact, errors, factors = d5_eigenvalues(form), {}, (4, 2, 1, 0.5)
        for factor in factors:
            settings = dict(FEM, **{"Implicit solver/Start steps": 0, "Implicit solver/Step factor": factor,
                                    "Seepage inertia": "true" if form == "up" else "false"})
            for name, column in (("velocity in the middle", "V_%s [m/s]"), ("pressure at the base", "P_%s [Pa]")):
                settings["References/%s/Columns" % name] = column % form
            p = c.run("D5_standing_wave", settings).table("probes.csv")
            found = fit_decay(p["time"], p["middle/velocity y"], exact)
            errors[factor] = [abs(a / b - 1.) for a, b in zip(found, exact)]
        c.below(form + ": imaginary part", errors[0.5][1], 2e-3)
        c.below(form + ": real part", errors[0.5][0], 2e-2)
        # At half of h/c_u the error of space, 1e-4, begins to count.
        c.order(form + ": imaginary part over the step", [1. / f for f in factors[:3]],
                [errors[f][1] for f in factors[:3]], 1.8)


def rest(c):
    """A static stage, then a thousand explicit steps that must not move anything."""
    def check(name, scene, settings, bound=1e-10):
        run = c.run(scene, settings)
        speed = max(run.table("statistics.csv")["largest speed"])
        # c_u of the scenes is about 1.65e3 m/s.
        c.below(name + ": speed over c_u", speed / 1.65e3, bound)
        return run

    for basis in ("q1", "gimp"):
        for offset in (0, 0.37):
            run = check("level, %s, offset %g" % (basis, offset), "G1_static",
                        {"Explicit MPM/Basis": basis, "Constants/offset": offset})
            c.below("  pressure", run.error("pressure", "Linf"), 1e-8)
            c.below("  stresses", max(run.error(s + " stress", "Linf") for s in ("vertical", "horizontal")), 1e-8)
        for shift in (0, 0.37):
            check("slope, %s, shift %g" % (basis, shift), "G2_layered_slope",
                  {"Explicit MPM/Basis": basis, "Constants/shift": shift}, 1e-8)
    for z_w in (7, 13):
        run = check("water table at %g m" % z_w, "G1_static", {"Constants/z_w": z_w, "Constants/offset": 0.37})
        c.below("  pressure", run.error("pressure", "Linf"), 1e-8)
    run = check("finite elements", "G1_static", FEM)
    c.below("  stresses", max(run.error(s + " stress", "Linf") for s in ("vertical", "horizontal")), 1e-8)
    # Handed over by finite elements the state is out of balance by the quadrature of cut cells. The energy of the
    # waves that this makes is quadratic in it; single points in slivers may be fast at any resolution.
    sizes = (1., 0.5, 0.25)
    energies = [max(c.run("G2_layered_slope", {"Stages/geostatic/Static state": "fem", "Constants/h": h,
                                               "Constants/End": 0.1}).table("statistics.csv")["kinetic energy"])
                for h in sizes]
    c.order("slope from finite elements: kinetic energy", [1. / h for h in sizes], energies, 2.)


def parallel(c):
    scenes_and_settings = {
        "P1_terzaghi": dict(QUASI_STATIC, **{"Constants/cells": 20}),
        "D3_ramp": dict(with_fem(cells=20, End=0.1), **{"References/pressure/Times": "0.03, 0.1",
                                                        "References/pressure/Columns":
                                                        "p(t=0.03 s) [Pa], p(t=0.1 s) [Pa]",
                                                        "References/displacement of the top/Start": 0}),
        "G2_layered_slope": FEM}
    for scene, settings in scenes_and_settings.items():
        runs = [c.run(scene, settings, ranks=n) for n in (1, 2, 3)]
        for n, run in zip((2, 3), runs[1:]):
            difference, column = compare_tables(runs[0].directory + "/probes.csv", run.directory + "/probes.csv")
            # Systems are solved to 1e-11.
            c.below("%s, %d ranks (%s)" % (scene, n, column), difference, 1e-7)


CASES = {
    "P1": (p1, ("quick", "full"), 10),
    "D2": (d2, ("quick", "full"), 1),
    "D3": (d3, ("full",), 20),
    "D5": (d5, ("quick", "full"), 2),
    "rest": (rest, ("full",), 20),
    "parallel": (parallel, ("full",), 30),
}

if __name__ == "__main__":
    scenes.CASES = CASES
    sys.exit(scenes.main())
