#!/usr/bin/env python3
"""Run the scenes of prm/verification with finite elements, and with material points in implicit steps.

    fem_scenes.py --peat build/peat --case NAME [--ranks N] [--keep DIR]
    fem_scenes.py --list quick|full

Bounds are those of the scenes' parameter files, where they are explained; a bound that differs says why beside it.
"""
import json
import os
import subprocess
import sys

from math import atan2, cos, exp, hypot, pi, sin

import scene_tools
from scene_tools import SCENES, TABLES, compare_tables, fit_decay, fitted_order, least_squares, read_table
from scenes import d5_eigenvalues

FEM = {"Method": "fem"}
STEADY = {"Stages/consolidation/Solver": "quasi-static"}
# Name, settings: the discretisations of the implicit solvers.
DISCRETE = (("taylor-hood", dict(FEM)), ("q1", dict(FEM, **{"Implicit solver/Element": "q1"})),
            ("points, gimp", {"Method": "mpm"}), ("points, q1", {"Method": "mpm", "Explicit MPM/Basis": "q1"}))


def settled(c, scene, displacement, end, sizes=(10, 20, 40)):
    for name, method in DISCRETE:
        settings = dict(method, **STEADY)
        run = c.run(scene, settings)
        c.below(name + ": pressure (rms over cells, all times)", run.error("pressure", "L2"), 3e-3)
        c.below(name + ": displacement, Linf", run.error(displacement, "Linf"), 5e-3)
        # Steps short enough that what is left is the error of space.
        runs = [c.run(scene, dict(settings, **{"Constants/cells": n, "Implicit solver/Step tolerance": 1e-4}))
                for n in sizes]
        errors = [r.errors_at_times("pressure")[-1] for r in runs]
        if name == "taylor-hood":
            c.order(name + ": pressure at the end", sizes, errors, 1.8)
        else:
            # Not 2 as it should be, but 1.4 to 1.7 (P2, q1: no order at all) at errors below 1e-4, and not because of the
            # steps; the stabilised pressures are the suspects. Open: to be asserted when understood.
            c.report(name + ": pressure at the end, order (open)", "%.2f" % fitted_order(sizes, errors))


def p1(c):
    settled(c, "P1_terzaghi", "settlement", 0.2)
    run = c.run("P1_terzaghi", dict(FEM, **STEADY, **{
        "Constants/End": "2*t_1", "Constants/cells": 20, "Implicit solver/Step tolerance": 3e-3}))
    c.below("steps to T = 2 with a tolerance of 3e-3", run.summary["steps"], 59)
    c.below("pressure then (rms over cells, all times)", run.error("pressure", "L2"), 1e-2)
    c.below("settlement then, Linf", run.error("settlement", "Linf"), 1e-2)


def p2(c):
    settled(c, "P2_selfweight_consolidation", "displacement", 0.02)


def p3(c):
    for name, method in DISCRETE[:3]:
        run = c.run("P3_two_layer", method)
        c.below(name + ": pressure (rms over cells, all times)", run.error("pressure", "L2"), 5e-3)
        c.below(name + ": settlement, Linf", run.error("settlement", "Linf"), 5e-3)
        c.below(name + ": pressure at the base, Linf", run.error("pressure at the base", "Linf"), 5e-3)


class Mandel:
    """The series of Cheng and Detournay (1988), see reference/exact/mandel.py; constants as in P4_mandel.prm."""

    def __init__(self, nu=0.2, K_f=2.2e9, terms=300):
        E, n, F, a, k = 1e7, 0.4, 100., 1., 1e-5
        self.nu, self.G, self.F, self.a, Q = nu, E / (2. * (1. + nu)), F, a, K_f / n
        K = E / (3. * (1. - 2. * nu))
        M = K + 4. / 3. * self.G
        self.nu_u = (3. * (K + Q) - 2. * self.G) / (2. * (3. * (K + Q) + self.G))
        self.p0 = F * Q / (K + Q) * (1. + self.nu_u) / (3. * a)
        self.t_1 = a**2 / (k / (1000. * 9.81) / (1. / Q + 1. / M))
        self.way = F * (self.nu_u - nu) / (2. * self.G)    # of the side, from the undrained state to the end
        ratio, self.roots = (1. - nu) / (self.nu_u - nu), []
        for m in range(terms):
            low, high = m * pi + 1e-9, (m + 0.5) * pi - 1e-13
            value = lambda b: sin(b) - ratio * b * cos(b)
            for _ in range(60):
                middle = 0.5 * (low + high)
                low, high = (middle, high) if value(middle) * value(low) > 0. else (low, middle)
            self.roots.append(low)

    def at(self, t):
        """Pressure in the middle over p0, and motion of the side over its way, at t >= 1e-3 t_1."""
        p, c, s = 0., 0., 0.
        for b in self.roots:
            decay = exp(-b * b * t / self.t_1) / (b - sin(b) * cos(b))
            p += sin(b) * (1. - cos(b)) * decay
            c += sin(b) * cos(b) * decay
        u = self.nu / 2. - self.nu_u * c + c - self.nu_u / 2.
        return 2. * p, u * self.F / self.G / self.way

    def peak(self):
        """The largest pressure in the middle over p0, and its time over t_1."""
        times = [10.**(-2.5 + 2e-3 * m) for m in range(1000)]
        return parabola(times, [self.at(t * self.t_1)[0] for t in times])


def parabola(t, y):
    """Largest value and its time, by a parabola through the largest sample and those beside it."""
    m = y.index(max(y))
    (a, b, c), _ = least_squares([[1.] * 3, [v - t[m] for v in t[m - 1:m + 2]], [(v - t[m])**2 for v in t[m - 1:m + 2]]],
                                 y[m - 1:m + 2])
    return a - b * b / (4. * c), t[m] - b / (2. * c)


def check_mandel(c, name, run, series, bounds):
    """bounds: of pressure, motion of the side, largest pressure and its time."""
    probes = run.table("probes.csv")
    t, p = probes["time"], [v / series.p0 for v in probes["middle/pressure"]]
    late = [m for m in range(len(t)) if t[m] >= 1e-3 * series.t_1]
    known = {m: series.at(t[m]) for m in late}
    c.below(name + ": pressure in the middle, Linf", max(abs(p[m] - known[m][0]) for m in late), bounds[0])
    c.below(name + ": motion of the side, Linf",
            max(abs(probes["side/displacement x"][m] / series.way - known[m][1]) for m in late), bounds[1])
    if len(bounds) > 2:
        (top, when), (exact_top, exact_when) = parabola(t, p), series.peak()
        c.below(name + ": largest pressure over p0", abs(top - exact_top), bounds[2])
        c.below(name + ": its time over that of the series", abs(when / series.t_1 / exact_when - 1.), bounds[3])
    c.below(name + ": momentum", run.summary["balance"]["momentum"], 1e-8)


def p4(c, cells=40):
    tight = (5e-3, 5e-3, 3e-3, 3e-2)
    for name, method in DISCRETE:
        # Peaks are flat: steps of the usual tolerance say where they are to 5 %.
        settings = dict(method, **{"Constants/cells": cells, "Implicit solver/Step tolerance": 1e-4})
        bounds = tight if method["Method"] == "fem" else (2e-2,) * 4
        check_mandel(c, name, c.run("P4_mandel", settings), Mandel(), bounds)
    # The plate knows the force alone, so it is right for any ground; K_f = 1e7 Pa: gassy water, Q = 4.5 K_d.
    for nu, K_f in (0., 2.2e9), (0.4, 2.2e9), (0.2, 1e7):
        run = c.run("P4_mandel", dict(FEM, **{"Constants/cells": 20, "Constants/nu": nu, "Constants/K_f": K_f,
                                              "Implicit solver/Step tolerance": 1e-4}))
        check_mandel(c, "nu = %g, K_f = %g" % (nu, K_f), run, Mandel(nu, K_f), tight)


def p4_early(c):
    """Steps that follow waves, as far as they come: the front of the drained part has gone 0.17 a."""
    series = Mandel()
    for scheme, cells in ("explicit", 20), ("semi-implicit", 40):
        settings = {"Method": "mpm", "Stages/consolidation/Solver": "dynamic", "Stages/consolidation/Scheme": scheme,
                    "Constants/cells": cells, "Constants/End": "0.01*t_1"}
        check_mandel(c, scheme, c.run("P4_mandel", settings), series, (2e-2, 2e-2))


def tied(c):
    """Of what acts on a plate the sum counts, whatever the ranks, in two and three dimensions."""
    dynamic = {"Stages/consolidation/Solver": "dynamic", "Constants/cells": 10, "Constants/End": "2e-3*t_1"}
    kinds = {"finite elements": FEM, "points": {"Method": "mpm"},
             "multigrid": dict(FEM, **{"Linear solver/Method": "iterative"}),
             "dynamic elements": dict(dynamic, **FEM, **{"Implicit solver/Time step": "1e-4*t_1"}),
             "explicit": dict(dynamic, Method="mpm", **{"Stages/consolidation/Scheme": "explicit"}),
             "semi-implicit": dict(dynamic, Method="mpm", **{"Stages/consolidation/Scheme": "semi-implicit",
                                                             "Explicit MPM/Pressure tolerance": 1e-13})}
    few = {"Constants/cells": 10, "Implicit solver/Time step": "t_1/50", "Constants/End": "0.1*t_1"}
    for scene in "P4_mandel", "P4_mandel_3d":
        for name, kind in kinds.items():
            if scene == "P4_mandel_3d" and name == "explicit":
                continue
            # The probe at the side stands within a cell, so that it is on one rank.
            third = ", h/3" if scene == "P4_mandel_3d" else ""
            settings = dict(few, **{"Probes/side/Point": "a - h/3, b/2 - h/3" + third}, **kind)
            if third:
                settings["Constants/cells"] = 6
            n = c.rank_counts[-1]
            runs = [c.run(scene, settings, ranks=1), c.run(scene, settings, ranks=n)]
            difference, column = compare_tables(runs[0].directory + "/probes.csv", runs[1].directory + "/probes.csv")
            c.below("%s, %s, %d ranks (%s)" % (scene, name, n, column), difference, 1e-7)
            uneven = c.run(scene, dict(settings, **{"Conditions/force/Value": "0, -2*F/a^2*x" + (", 0" if third else "")}))
            difference, column = compare_tables(runs[0].directory + "/probes.csv", uneven.directory + "/probes.csv")
            # On material points the force stands where the surface is, which leaves the plate's nodes by 1e-4 of a cell.
            c.below("%s, %s, uneven force (%s)" % (scene, name, column), difference,
                    1e-4 if kind["Method"] == "mpm" else 1e-7)
            if third and name != "dynamic elements":
                flat = c.run("P4_mandel", dict(settings, **{"Probes/side/Point": "a - h/3, b/2 - h/3"}))
                a, b = flat.table("probes.csv"), runs[0].table("probes.csv")
                # The stabilisation of cell pressures acts at nodes inside the body, of which two cells along z have fewer.
                c.below("%s against 2-D: pressure in the middle" % name,
                        max(abs(v - w) for v, w in zip(a["middle/pressure"], b["middle/pressure"])) / 50.,
                        1e-3 if name == "semi-implicit" else 1e-5)


def p5(c, cells, method, pressure, displacement):
    run = c.run("P5_strip", dict(method, **{"Constants/cells": cells}))
    for name in run.summary["errors"]:
        c.below(name + ", Linf over time", run.error(name, "Linf"), pressure if name.startswith("pressure") else displacement)


def d1(c, omegas=(50, 500)):
    table = read_table(os.path.join(TABLES, "D1_harmonic.csv"))
    rows = list(zip(*(table[k] for k in table)))
    for form, inertia in ((0, "true"), (1, "false")):
        for omega in omegas:
            run = c.run("D1_harmonic", {"Constants/omega": omega, "Seepage inertia": inertia})
            probes = run.table("probes.csv")
            name = "%s, omega = %g: " % (("up", "up0")[form], omega)
            begin = 12. * 2. * pi / omega
            keep = [i for i, t in enumerate(probes["time"]) if t >= begin * (1. - 1e-9)]
            t = [probes["time"][i] for i in keep]
            # A slow rest of the start is still there: a parabola in two periods.
            s = [(v - t[0]) / (t[-1] - t[0]) for v in t]
            basis = [[cos(omega * v) for v in t], [sin(omega * v) for v in t], [1.] * len(t), s, [v * v for v in s]]
            known = [r for r in rows if r[0] == omega and r[1] == form]
            for probe, z, column, k in (("base", 0., "pressure", 5), ("quarter", 2.5, "pressure", 5),
                                        ("middle", 5., "pressure", 5), ("high", 7.5, "pressure", 5),
                                        ("top", 10., "displacement y", 3)):
                y = [probes["%s/%s" % (probe, column)][i] for i in keep]
                (a, b), scale = least_squares(basis, y)[0][:2], max(r[k] for r in known)
                r = next(r for r in known if r[2] == z)
                # The load is q sin(omega t) = Im(q exp(i omega t)).
                c.below(name + "amplitude of the %s, %s" % (column, probe), abs(hypot(a, b) - r[k]) / scale, 1e-2)
                c.below(name + "phase", abs((atan2(a, b) - r[k + 1] + pi) % (2. * pi) - pi), 2e-2)


def d2(c):
    run = c.run("D2_step", FEM)
    for name in ("pressure at the base", "pressure in the middle", "displacement of the top"):
        c.below(name + ", L1", run.error(name, "L1"), 5e-2)


def d3(c, sizes=(10, 20, 40)):
    runs = [c.run("D3_ramp", dict(FEM, **{"Constants/cells": n})) for n in sizes]
    c.below("pressure (rms over cells, all times)", runs[-1].error("pressure", "L2"), 1e-2)
    c.below("displacement of the top for t >= 0.1 s, Linf", runs[-1].error("displacement of the top", "Linf"), 1e-2)
    c.below("pressure at the base, Linf", runs[-1].error("pressure at the base", "Linf"), 1e-2)
    c.order("pressure at the base", sizes, [r.error("pressure at the base", "L2") for r in runs], 1.8)


def d5(c, sizes=(10, 20, 40)):
    exact, errors = d5_eigenvalues("up"), []
    for n in sizes:
        run = c.run("D5_standing_wave", dict(FEM, **{"Constants/cells": n, "Implicit solver/Start steps": 0,
                                                     "Implicit solver/Time step": 6e-4 / n}))
        p = run.table("probes.csv")
        errors.append([abs(a / b - 1.) for a, b in zip(fit_decay(p["time"], p["middle/velocity y"], exact), exact)])
    c.below("imaginary part at 40 cells a wave length", errors[1][1], 2e-3)
    c.below("real part", errors[1][0], 2e-2)
    c.order("imaginary part", sizes, [e[1] for e in errors], 1.8)


def compared(c, scene, settings, fields, sizes=(10, 20)):
    """peat compare: material points minus finite elements vanish at the order of the former."""
    found = []
    for n in sizes:
        directory = os.path.join(c.root, "compare_%d" % n)
        command = [c.peat, "compare", os.path.join(SCENES, scene + ".prm"), "--quiet", "--output", directory]
        for key, value in dict(settings, **{"Constants/cells": n}).items():
            command += ["--set", "%s=%s" % (key, value)]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        found.append(json.load(open(os.path.join(directory, "summary.json")))["compare"])
    for field in fields:
        c.order(field + ", points minus elements", sizes, [f[field]["relative_L2"] for f in found], 1.8)


def d6(c, cells, method, bound):
    run = c.run("D6_strip_pulse", dict(method, **{"Constants/cells": cells}))
    for name in run.summary["errors"]:
        c.below(name + ", Linf over time", run.error(name, "Linf"), bound)


def d7(c):
    sizes = (8, 16, 32)
    # Where pressures diffuse fast (k = 1e-2 m/s) their own error, h^2, also drives the displacements, whose order falls from
    # 3 towards 2 (measured: 2.5; 2.9 with a pressure thirty times smaller). At k = 1e-5 m/s it does not.
    for element, k, order in (("taylor-hood", 1e-5, 3), ("taylor-hood", 1e-2, 2.5), ("q1", 1e-2, 2)):
        # Second order in time, h^1.5 a step: as good as the third in space.
        runs = [c.run("D7_manufactured", {"Constants/cells": n, "Constants/k": k, "Implicit solver/Element": element})
                for n in sizes]
        for name, expected in (("displacement x", order), ("displacement y", order), ("velocity x", 2), ("pressure", 2)):
            c.order("%s, k = %g: %s, L2" % (element, k, name), sizes, [r.error(name, "L2") for r in runs], expected - 0.2)


def g1(c):
    for h_w in (0, 3):
        for name, method, bound in (("taylor-hood", FEM, 1e-6), ("points", {"Method": "mpm"}, 1e-2)):
            run = c.run("G1_gravity", dict(method, **{"Constants/h_w": h_w}))
            for field in ("displacement", "pressure", "vertical stress", "horizontal stress"):
                c.below("%s, h_w = %g: %s, Linf" % (name, h_w, field), run.error(field, "Linf"), bound)
    run = c.run("G1_rest", FEM)
    c.below("start from the exact state: displacement over height", run.error("displacement", "Linf"), 1e-6)
    c.below("start from the exact state: pressure", run.error("pressure", "Linf"), 1e-6)


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
    for offset in (0, 0.37):
        run = check("level in 3-D, offset %g" % offset, "G1_static_3d", {"Constants/offset": offset})
        c.below("  pressure", run.error("pressure", "Linf"), 1e-8)
        c.below("  stresses", max(run.error(s + " stress", "Linf") for s in ("vertical", "horizontal")), 1e-8)
    # A given K0 on level ground is in equilibrium as it is.
    run = check("K0 = 0.7", "G1_static", {"Stages/geostatic/K0": 0.7, "References/horizontal stress/Value":
                                         "0.7*(-(rho - rho_f)*g*(H - y))"})
    c.below("  stresses", max(run.error(s + " stress", "Linf") for s in ("vertical", "horizontal")), 1e-8)
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


def parallel_implicit(c):
    cases = {
        "P1_terzaghi": dict({"Stages/consolidation/Solver": "quasi-static"}, **{"Constants/cells": 20}),
        "D3_ramp": dict(FEM, **{"Constants/cells": 20, "Constants/End": 0.1,
                               "References/pressure/Times": "0.03, 0.1",
                                                        "References/pressure/Columns":
                                                        "p(t=0.03 s) [Pa], p(t=0.1 s) [Pa]",
                                                        "References/displacement of the top/Start": 0}),
        "P5_strip": dict(FEM, **{"Constants/cells": 2})}
    for scene, settings in cases.items():
        runs = [c.run(scene, settings, ranks=n) for n in c.rank_counts]
        for n, run in zip(c.rank_counts[1:], runs[1:]):
            difference, column = compare_tables(runs[0].directory + "/probes.csv", run.directory + "/probes.csv")
            # Systems are solved to 1e-11.
            c.below("%s, %d ranks (%s)" % (scene, n, column), difference, 1e-7)


def s7(c, sizes=(4, 8, 16)):
    for name, method in (("points, gimp", {"Explicit MPM/Basis": "gimp"}), ("points, q1", {"Explicit MPM/Basis": "q1"}),
                         ("elements, q1", FEM)):
        runs = [c.run("S7_bending", dict(method, **{"Constants/cells": n})) for n in sizes]
        c.below(name + ": deflection", runs[1].error("deflection", "Linf"), 1e-2)
        c.order(name + ": deflection", sizes, [r.error("deflection", "L2") for r in runs], 1.8)
    # Quadratic functions have the solution among them.
    run = c.run("S7_bending", dict(FEM, **{"Implicit solver/Element": "taylor-hood"}))
    c.below("taylor-hood: deflection", run.error("deflection", "Linf"), 1e-6)


MPM = {"Method": "mpm"}
# name: (function, labels, seconds on one core); those without a label are long, and run by hand.
CASES = {
    "fem_P1": (p1, ("full",), 20),
    "fem_P2": (p2, ("full",), 15),
    "fem_P3": (p3, ("full",), 8),
    "fem_P4": (p4, ("full",), 100),
    "P4_early": (p4_early, ("full",), 40),
    "tied": (tied, ("full",), 70),
    "fem_P5": (lambda c: p5(c, 8, FEM, 5e-3, 3e-3), ("full",), 60),
    "fem_P5_points": (lambda c: p5(c, 16, MPM, 2e-2, 1e-2), (), 300),
    "fem_D1": (d1, ("full",), 20),
    "fem_D2": (d2, ("quick", "full"), 2),
    "fem_D3": (d3, ("full",), 8),
    "fem_D5": (d5, ("full",), 8),
    "fem_D5_compare": (lambda c: compared(c, "D5_standing_wave", {"Implicit solver/Start steps": 0},
                                          ("pressure", "displacement y", "velocity y")), ("full",), 8),
    "fem_D3_compare": (lambda c: compared(c, "D3_ramp", {"Scheme": "semi-implicit"}, ("pressure", "displacement y"),
                                          (40, 80)), ("full",), 20),   # with less the drained layer is a cell
    "fem_D6": (lambda c: d6(c, 8, FEM, 1e-2), ("full",), 270),
    "fem_D6_points": (lambda c: d6(c, 8, MPM, 5e-2), (), 300),
    "fem_D7": (d7, ("full",), 20),
    "fem_S7": (s7, ("full",), 5),
    "rest": (rest, ("full",), 20),
    "parallel_implicit": (parallel_implicit, ("full",), 20),
    "fem_G1": (g1, ("quick", "full"), 5),
}

if __name__ == "__main__":
    sys.exit(scene_tools.main(CASES, __doc__))
