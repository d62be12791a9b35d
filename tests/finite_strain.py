#!/usr/bin/env python3
"""Run the scenes of prm/verification in which material points are strained by large amounts.

    finite_strain.py --peat build/peat --case NAME [--ranks N] [--keep DIR]
    finite_strain.py --list quick|full

Bounds are those of the scenes' parameter files, where they are explained; a bound that differs says why beside it.
"""
import sys

import scene_tools

# Columns of the tables of L1 by the law.
OTHER_LAW = {"Bodies/column/Material": "neo-hookean", "References/settlement/Columns": "u_neohooke [m]",
             "References/pressure at the base/Columns": "p_base_neohooke [Pa]"}
for name, T in ("early", "0.1"), ("late", "0.5"):
    OTHER_LAW["References/pressure, %s/Coordinate" % name] = "y_neohooke(T=%s) [m]" % T
    OTHER_LAW["References/pressure, %s/Columns" % name] = "p_neohooke(T=%s) [Pa]" % T
FINAL = {"hencky": -0.2570806233, "neo-hookean": -0.3229670386}  # the stretch at which the law has the stress -q


def l1_bounds(c, run, law):
    c.below(law + ": settlement, Linf over H", run.error("settlement", "Linf"), 1e-2)
    final = run.table("probes.csv")["top/displacement y"][-1]
    c.below(law + ": final settlement over H", abs(final - FINAL[law]), 2e-3)
    for name in "early", "late":
        c.below("%s: pressure, %s (rms over cells)" % (law, name), run.error("pressure, " + name, "L2"), 1e-2)


def l1(c):
    for law, settings in (("hencky", {}), ("neo-hookean", OTHER_LAW)):
        run = c.run("L1_finite_strain_consolidation", dict(settings, **{"Constants/cells": 20}))
        l1_bounds(c, run, law)


def l1_full(c):
    for law, settings in (("hencky", {}), ("neo-hookean", OTHER_LAW)):
        l1_bounds(c, c.run("L1_finite_strain_consolidation", settings), law)


def l1_fem(c):
    """Finite elements stay where they are, so the tables' places do not apply to their pressures."""
    sizes, errors = (10, 20, 40), []
    for n in sizes:
        run = c.run("L1_finite_strain_consolidation", {"Method": "fem", "Constants/cells": n})
        errors.append(run.error("pressure at the base", "L2"))
    c.below("settlement, Linf over H", run.error("settlement", "Linf"), 1e-3)
    c.below("pressure at the base (rms)", errors[-1], 1e-3)


def vector_errors(run, field):
    """Errors of all components together at the times of the references, rms over points."""
    names = [name for name in run.summary["errors"] if name.startswith(field)]
    return [sum(e**2 for e in errors)**0.5 for errors in zip(*(run.errors_at_times(name) for name in names))]


def s6_manufactured(c, scene, sizes, bound):
    runs = [c.run(scene, {"Constants/cells": n}) for n in sizes]
    for field, times in ("displacement", ("1/c", "2/c")), ("stretch", ("1/(2c)", "3/(2c)")):
        errors = [vector_errors(run, field) for run in runs]
        for i, t in enumerate(times):
            c.below("%s at t = %s, %d cells" % (field, t, sizes[-1]), errors[-1][i], bound)
            c.order("%s at t = %s" % (field, t), sizes, [e[i] for e in errors], 1.8)


def s6(c):
    s6_manufactured(c, "S6_manufactured", (10, 20, 40), 2e-2)


def s6_3d(c):
    """The errors fall with the square of the cell: four times the bound of half the cell."""
    s6_manufactured(c, "S6_manufactured_3d", (10, 20), 8e-2)


def s6_vortex(c):
    sizes = (24, 48, 96)
    errors = [vector_errors(c.run("S6_vortex", {"Constants/cells": n}), "displacement") for n in sizes]
    c.below("displacement at t = 1/2, 96 cells", errors[-1][0], 2e-2)
    c.order("displacement at t = 1/2", sizes, [e[0] for e in errors], 1.8)


# name: (function, labels, seconds on one core)
CASES = {
    "L1": (l1, ("quick", "full"), 10),
    "L1_full": (l1_full, ("full",), 60),
    "L1_fem": (l1_fem, ("full",), 10),
    "S6_manufactured": (s6, ("full",), 20),
    "S6_manufactured_3d": (s6_3d, ("full",), 60),
    "S6_vortex": (s6_vortex, ("full",), 60),
}

if __name__ == "__main__":
    sys.exit(scene_tools.main(CASES, __doc__))
