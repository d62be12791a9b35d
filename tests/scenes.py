#!/usr/bin/env python3
"""Run the scenes of prm/verification and hold the results against what is known of them.

    scenes.py --peat build/peat --case NAME [--ranks N] [--keep DIR]
    scenes.py --list quick|full

A case runs one or more scenes, prints a table of measured values and their bounds, and ends with exit code 1 if a bound is
not kept. Where the bounds come from stands beside them; those of a scene are explained in its parameter file.
"""
import argparse
import base64
import csv
import json
import math
import os
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ElementTree
import zlib

SCENES = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "prm", "verification")
TABLES = os.path.join(SCENES, "reference", "data")


# ------------------------------------------------------------------------------------------------ running and reading
class Run:
    """One run of peat and what it wrote."""

    def __init__(self, directory, code, message):
        self.directory, self.code, self.message = directory, code, message
        path = os.path.join(directory, "summary.json")
        self.summary = json.load(open(path)) if os.path.exists(path) else {}

    @property
    def completed(self):
        return self.code == 0 and self.summary.get("completed", False)

    def error(self, reference, norm):
        """Relative error against a reference of the scene over all its times; norm: L1, L2 or Linf."""
        entry = self.summary["errors"][reference]
        value = entry["relative_" + norm]
        return float("nan") if value is None or entry["compared"] == 0 else value

    def errors_at_times(self, reference, norm="L2"):
        rows = [row for row in read_table(os.path.join(self.directory, "errors.csv"), text=True)
                if row["reference"] == reference]
        return [float(row["relative " + norm]) for row in rows]

    def table(self, name):
        """Columns of statistics.csv or probes.csv by their names without units."""
        rows = read_table(os.path.join(self.directory, name), text=True)
        columns = {}
        for key in rows[0]:
            values = [row[key] for row in rows]
            try:
                columns[re.sub(r" \[.*\]$", "", key)] = [float(v) if v else float("nan") for v in values]
            except ValueError:
                pass
        return columns

    def points(self, body):
        """Fields of a body's points in the last picture: name -> list of tuples."""
        folder = os.path.join(self.directory, "pictures")
        return read_vtu(os.path.join(folder, sorted(f for f in os.listdir(folder) if f.startswith(body + "-"))[-1]))


def read_table(path, text=False):
    with open(path) as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    return rows if text else {key: [float(row[key]) for row in rows] for key in rows[0]}


def read_vtu(path):
    """The arrays of a .vtu file with compressed binary data, as deal.II writes it."""
    def decode(text):
        text = text.strip()
        n = struct.unpack("<I", base64.b64decode(text[:8])[:4])[0]
        size = 4 * (3 + n)
        end = (size + 2) // 3 * 4
        sizes = struct.unpack("<%dI" % (3 + n), base64.b64decode(text[:end])[:size])[3:]
        data, begin, result = base64.b64decode(text[end:]), 0, b""
        for length in sizes:
            result += zlib.decompress(data[begin:begin + length])
            begin += length
        return result

    codes = {"Float64": "d", "Float32": "f", "Int32": "i", "UInt32": "I", "UInt8": "B", "Int64": "q", "UInt64": "Q"}
    arrays = {}
    for piece in ElementTree.parse(path).getroot().iter("Piece"):
        for array in piece.iter("DataArray"):
            raw, code = decode(array.text), codes[array.get("type")]
            values = struct.unpack("<%d%s" % (len(raw) // struct.calcsize(code), code), raw)
            n = int(array.get("NumberOfComponents") or 1)
            arrays.setdefault(array.get("Name") or "position", []).extend(
                tuple(values[i:i + n]) for i in range(0, len(values), n))
    return arrays


class Context:
    """What a case works with: it runs scenes and notes what it finds."""

    def __init__(self, peat, ranks, keep):
        self.peat, self.ranks, self.keep = os.path.abspath(peat), ranks, keep
        self.root = keep or tempfile.mkdtemp(prefix="peat-scenes-")
        self.n_runs, self.failed, self.lines = 0, False, []

    def run(self, scene, settings=None, ranks=None, may_fail=False):
        """Settings: {"Section/Key": value}."""
        self.n_runs += 1
        directory = os.path.join(self.root, "%03d_%s" % (self.n_runs, scene))
        command = [self.peat, "run", os.path.join(SCENES, scene + ".prm"), "--quiet", "--output", directory]
        for key, value in (settings or {}).items():
            command += ["--set", "%s=%s" % (key, value)]
        environment = dict(os.environ, OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1",
                           OMPI_MCA_rmaps_base_oversubscribe="1", OMP_NUM_THREADS="1")
        n = ranks or self.ranks
        if n > 1:
            command = ["mpirun", "-np", str(n)] + command
        done = subprocess.run(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, timeout=1200,
                              universal_newlines=True)
        run = Run(directory, done.returncode, done.stderr.strip())
        if not may_fail and not run.completed:
            self.note("%s %s completes" % (scene, settings or ""), False, "exit code %d: %s" % (run.code, run.message))
            raise Stop()
        return run

    def note(self, what, good, text):
        self.failed = self.failed or not good
        print("  %-6s %-58s %s" % ("ok" if good else "FAILED", what, text), flush=True)

    def below(self, what, value, bound):
        self.note(what, value <= bound, "%-11.3g <= %.3g" % (value, bound))

    def above(self, what, value, bound):
        self.note(what, value >= bound, "%-11.3g >= %.3g" % (value, bound))

    def report(self, what, text):
        print("  %-6s %-58s %s" % ("", what, text), flush=True)

    def order(self, what, sizes, errors, bound):
        """Slope of log(error) over log(1/size), least squares."""
        slope = fitted_order(sizes, errors)
        pairs = ", ".join("%g: %.2e" % pair for pair in zip(sizes, errors))
        self.note(what + ", order", slope >= bound, "%-11.3g >= %.3g   (%s)" % (slope, bound, pairs))


class Stop(Exception):
    pass


# ----------------------------------------------------------------------------------------------------------- arithmetic
def fitted_order(sizes, errors):
    x, y = [math.log(n) for n in sizes], [math.log(max(abs(e), 1e-300)) for e in errors]
    mx, my = sum(x) / len(x), sum(y) / len(y)
    return -sum((a - mx) * (b - my) for a, b in zip(x, y)) / sum((a - mx)**2 for a in x)


def crossings(t, y, level=0.):
    """Times at which y passes the level, by the cubic through the four samples around."""
    found = []
    for i in range(1, len(t) - 2):
        if (y[i] - level) * (y[i + 1] - level) < 0.:
            tt, yy = t[i - 1:i + 3], [v - level for v in y[i - 1:i + 3]]
            value = lambda s: sum(yy[k] * math.prod((s - tt[j]) / (tt[k] - tt[j]) for j in range(4) if j != k)
                                  for k in range(4))
            low, high = t[i], t[i + 1]
            for _ in range(50):
                middle = 0.5 * (low + high)
                low, high = (middle, high) if value(low) * value(middle) > 0. else (low, middle)
            found.append(0.5 * (low + high))
    return found


def solve(matrix, right):
    """Gauss with pivoting."""
    n = len(right)
    rows = [list(matrix[i]) + [right[i]] for i in range(n)]
    for k in range(n):
        pivot = max(range(k, n), key=lambda i: abs(rows[i][k]))
        rows[k], rows[pivot] = rows[pivot], rows[k]
        for i in range(k + 1, n):
            factor = rows[i][k] / rows[k][k]
            for j in range(k, n + 1):
                rows[i][j] -= factor * rows[k][j]
    x = [0.] * n
    for k in reversed(range(n)):
        x[k] = (rows[k][n] - sum(rows[k][j] * x[j] for j in range(k + 1, n))) / rows[k][k]
    return x


def least_squares(columns, y):
    normal = [[sum(p * q for p, q in zip(a, b)) for b in columns] for a in columns]
    c = solve(normal, [sum(p * q for p, q in zip(a, y)) for a in columns])
    return c, [v - sum(ck * col[i] for ck, col in zip(c, columns)) for i, v in enumerate(y)]


def fit_decay(t, y, rates):
    """Fit y = (A cos wt + B sin wt) exp(-a t) + C exp(-c t); from first guesses (a, w, c) to the best values."""
    def residual(p):
        a, w, c = p
        columns = [[math.exp(-a * s) * math.cos(w * s) for s in t], [math.exp(-a * s) * math.sin(w * s) for s in t],
                   [math.exp(-c * s) for s in t]]
        return least_squares(columns, y)[1]

    p = list(rates)
    for _ in range(12):
        r = residual(p)
        columns = []
        for k in range(3):
            step = 1e-6 * abs(p[k])
            q = p[:k] + [p[k] + step] + p[k + 1:]
            columns.append([(b - a) / step for a, b in zip(r, residual(q))])
        change = least_squares(columns, [-v for v in r])[0]
        p = [v + d for v, d in zip(p, change)]
        if max(abs(d / v) for v, d in zip(p, change)) < 1e-10:
            break
    return p


def amplitude(t, y, w):
    c, _ = least_squares([[math.cos(w * s) for s in t], [math.sin(w * s) for s in t], [1.] * len(t)], y)
    return math.hypot(c[0], c[1])


def interpolate(x, xs, ys):
    k = min(max(1, next((i for i, v in enumerate(xs) if v >= x), len(xs) - 1)), len(xs) - 1)
    share = (x - xs[k - 1]) / (xs[k] - xs[k - 1])
    return (1. - share) * ys[k - 1] + share * ys[k]


# ------------------------------------------------------------------------------------------------ solids in one phase
S1_RATE = math.pi / 50. * 10.   # b c of S1_bar_mode.prm


def frequency_error(run):
    """From the moments when the bar's momentum changes its sign."""
    s = run.table("statistics.csv")
    times = crossings(s["time"], s["momentum x"])
    return math.pi * (len(times) - 1) / (times[-1] - times[0]) / S1_RATE - 1.


def s1(c):
    for basis, v0 in (("gimp", 0.1), ("gimp", 0.01), ("q1", 0.01)):
        run = c.run("S1_bar_mode", {"Explicit MPM/Basis": basis, "Constants/v0": v0})
        name = "%s, v0 = %g: " % (basis, v0)
        s = run.table("statistics.csv")
        t, momentum = s["time"], s["momentum x"]
        n = len(t) // 4
        loss = 1. - amplitude(t[-n:], momentum[-n:], S1_RATE) / amplitude(t[:n], momentum[:n], S1_RATE)
        energy = [k + e for k, e in zip(s["kinetic energy"], s["elastic energy"])]
        # Lumped mass and the symplectic step: -(b h)^2/24 + (w dt)^2/24 = -6.4e-5 at 40 cells.
        c.below(name + "frequency", abs(frequency_error(run)), 3e-4)
        c.below(name + "amplitude lost in four periods", loss, 5e-3)
        c.below(name + "energy over time", max(abs(e / energy[0] - 1.) for e in energy), 1e-2)
        # w dt/2 = 0.2 %: the velocities of the symplectic step belong to the middle of the step.
        c.below(name + "velocity, L2", run.error("velocity", "L2"), 5e-3)
        if v0 == 0.1:
            c.below(name + "velocity of the end, L1", run.error("velocity of the end", "L1"), 2e-2)
    sizes = (10, 20, 40)
    errors = [frequency_error(c.run("S1_bar_mode", {"Constants/cells": n, "Constants/v0": 1e-3})) for n in sizes]
    c.order("frequency", sizes, errors, 1.8)
    # PIC loses energy at every step; a scheme that does not show it here would hide its damping elsewhere, too.
    s = c.run("S1_bar_mode", {"Explicit MPM/Transfer": "pic"}).table("statistics.csv")
    c.above("pic: energy lost", 1. - (s["kinetic energy"][-1] + s["elastic energy"][-1]) / s["kinetic energy"][0], 0.5)


def s1_3d(c):
    run = c.run("S1_bar_mode_3d")
    c.below("frequency", abs(frequency_error(run)), 3e-4)
    c.below("velocity, L2", run.error("velocity", "L2"), 5e-3)
    s = run.table("statistics.csv")
    energy = [k + e for k, e in zip(s["kinetic energy"], s["elastic energy"])]
    c.below("energy over time", max(abs(e / energy[0] - 1.) for e in energy), 1e-2)


def s2(c):
    run = c.run("S2_bar_step")
    # 1 % is reached only close to dt = h/c, which slivers at a moving end do not allow: 1.07 % at the automatic step.
    c.below("displacement of the end, Linf", run.error("displacement of the end", "Linf"), 1.2e-2)
    c.below("velocity in the middle, L1", run.error("velocity in the middle", "L1"), 3e-2)
    p, T, h = run.table("probes.csv"), 1e-2, 1e-2   # L/c, h/L
    t, stress = p["time"], p["support/effective stress xx"]
    plateau = [s for u, s in zip(t, stress) if 1.3 * T < u < 2.7 * T]
    c.below("plateau of the stress at the support", abs(sum(plateau) / len(plateau) / 2000. - 1.), 1e-2)
    fronts = crossings(t, stress, 1000.)
    late = [abs(found - expected * T) / (h * T) for expected in (1, 3, 5, 7)
            for found in [min(fronts, key=lambda f: abs(f - expected * T))]]
    c.below("fronts at the support [h/c]", max(late), 2.)
    s = run.table("statistics.csv")
    energy = [k + e for k, e in zip(s["kinetic energy"], s["elastic energy"])]
    c.below("work of the traction", max(abs(w - e) for w, e in zip(s["external work"], energy)) / max(energy), 1e-2)


def s3(c):
    run = c.run("S3_gravity_step")
    rho, g, H, M = 2000., 9.81, 10., 1e9
    static, T = -rho * g * H * H / (2. * M), 4. * H / math.sqrt(M / rho)
    p = run.table("probes.csv")
    t, u = p["time"], p["top/displacement y"]
    c.below("largest displacement", abs(min(u) / (2. * static) - 1.), 5e-3)
    times = crossings(t, u, static)
    c.below("period", abs((times[-1] - times[0]) / (0.5 * (len(times) - 1)) / T - 1.), 3e-3)
    c.below("stress at the base, Linf", run.error("stress at the base", "Linf"), 3e-2)
    run = c.run("S3_gravity_step", {"Stages/fall/Local damping": 0.5, "Constants/g": 9.81e-3, "Constants/End": "200*H/c"})
    p = run.table("probes.csv")
    # Places are known to 1e-15 of 10 m, the displacement is 1e-6 m and made of ten thousand steps.
    c.below("static displacement", abs(p["top/displacement y"][-1] / (static * 1e-3) - 1.), 3e-6)
    c.below("static stress at the base", abs(p["base/effective stress yy"][-1] / (-rho * g * H * 1e-3) - 1.), 1e-6)


def s4_errors(run, law):
    """Charlton, Coombs and Augarde's measure of the stress, and the largest error of the places, over all points."""
    H, weight = 50., 80. * 10. * 50.
    reference = read_table(os.path.join(TABLES, "S4_column_selfweight.csv"))
    points = run.points(law.replace(" ", "_") + "_column")
    column = "y_%s [m]" % law.replace("-", "").replace("hookean", "hooke")
    error = mass = place = 0.
    for x, u, s, (m,) in zip(points["position"], points["displacement"], points["effective stress"], points["mass"]):
        Y = x[1] - u[1]
        error += m * abs(s[4] + weight * (1. - Y / H)) / weight
        mass += m
        place = max(place, abs(x[1] - interpolate(Y, reference["Y [m]"], reference[column])) / H)
    return error / mass, place


def s4(c):
    sizes, errors = (16, 32, 64), {}
    for n in sizes:
        run = c.run("S4_column_selfweight", {"Constants/cells": n})
        for law in ("hencky", "neo-hookean", "jaumann"):
            errors.setdefault(law, []).append(s4_errors(run, law))
    for law, found in errors.items():
        c.below(law + ": stress at points", found[-1][0], 1e-2)
        c.below(law + ": place of points", found[-1][1], 1e-3)
        c.order(law + ": stress", sizes, [stress for stress, _ in found], 1.)
    # The weight applied three times as fast: the column rings, and must not be lost.
    run = c.run("S4_column_selfweight", {"Constants/Ramp": "10*H/c"}, may_fail=True)
    c.note("fast loading completes", run.completed, run.message)


def largest(run, names, norm="Linf"):
    return max(run.error(name, norm) for name in names)


def s5_patch(c):
    components = ["stress " + component for component in ("xx", "yy", "zz", "xy")]
    everywhere = {"Constants/rim": 10, "Constants/e": 0.01}
    # Round-off of some hundred increments.
    for shift in (0, 0.37):
        run = c.run("S5_patch", dict(everywhere, **{"Constants/shift": shift}))
        c.below("all nodes prescribed, shift %g" % shift, largest(run, components), 1e-12)
        # The points move by 1e-10 of the body: about that much the weights change.
        run = c.run("S5_patch", {"Constants/shift": shift})
        c.below("rim prescribed, shift %g" % shift, largest(run, components), 1e-8)
    for sx, sy in ((0, 0), (0.37, 0), (0, 0.6), (0.37, 0.37), (0.6, 0.6)):
        run = c.run("S5_pressed_patch", {"Constants/sx": sx, "Constants/sy": sy}, may_fail=True)
        name = "at rest under tractions, shift (%g, %g)" % (sx, sy)
        if not run.completed:
            c.note(name, False, run.message)
            continue
        # The tractions act 1e-7 of a piece of the surface inside the body.
        c.below(name + ": velocity", run.error("velocity", "Linf"), 1e-6)
        c.below(name + ": stress", largest(run, ("stress yy", "stress xy")), 1e-6)


def s5_rigid_motion(c):
    run = c.run("S5_rigid_motion", {"Output/Pictures": "false"})
    c.below("displacement", largest(run, ("displacement x", "displacement y")), 1e-12)
    c.below("stress/E", largest(run, ("stress xx", "stress xy")), 1e-12)
    c.below("momentum", run.summary["balance"]["momentum"], 1e-13)
    # In free rotation nothing but what the transfers lose may change energy and angular momentum.
    run = c.run("S5_rigid_motion", {"Constants/omega": 6.2831853})
    s = run.table("statistics.csv")
    energy = [k + e for k, e in zip(s["kinetic energy"], s["elastic energy"])]
    points = run.points("block")
    spin = sum(m * (x[0] * v[1] - x[1] * v[0])
               for x, v, (m,) in zip(points["position"], points["velocity"], points["mass"]))
    centre, momentum = (s["center x"][-1], s["center y"][-1]), (s["momentum x"][-1], s["momentum y"][-1])
    spin -= centre[0] * momentum[1] - centre[1] * momentum[0]
    start = s["mass"][0] * 0.437**2 / 6. * 6.2831853
    c.below("rotating: center of mass", math.hypot(centre[0] - 3.51, centre[1] - 1.533), 1e-12)
    c.below("rotating: momentum", run.summary["balance"]["momentum"], 1e-13)
    c.below("rotating: energy gained or lost", abs(energy[-1] / energy[0] - 1.), 1e-2)
    # The exact start is that of the block; points have it but for (h/2a)^2 of the spin of their own parts.
    c.below("rotating: angular momentum", abs(spin / start - 1.), 3e-2)


def s5_rotation(c):
    for n in (500, 1000):
        run = c.run("S5_rotation", {"Constants/n": n})
        stretch = (1. + (2. * math.pi / n)**2)**(0.5 * n)
        p = run.table("probes.csv")
        far = math.hypot(p["corner/x"][-1], p["corner/y"][-1]) / math.hypot(0.4, 0.35)
        c.below("%d steps: log of the stretch of places over its value" % n, math.log(far) / math.log(stretch), 1.01)
        # What remains is the difference between the stretch of the deformation gradient and its formula.
        c.below("%d steps: stress/E against that of the stretch" % n, largest(run, ("stress xx", "stress xy")),
                0.02 * math.log(stretch))


def s5_shear(c):
    run = c.run("S5_shear")
    for law in ("jaumann", "hencky"):
        c.below(law + ": stress/G at steps of 1e-3", largest(run, (law + " xx", law + " xy")), 1e-3)
    coarse = c.run("S5_shear", {"Constants/dt": 4e-3})
    c.order("jaumann: stress", (1, 4), [largest(r, ("jaumann xx", "jaumann xy")) for r in (coarse, run)], 0.9)
    # Simple shear adds up exactly in the deformation gradient: what is left is round-off of thousands of steps.
    c.below("hencky: stress/G at steps of 4e-3", largest(coarse, ("hencky xx", "hencky xy")), 1e-8)


# ------------------------------------------------------------------------------------------------------- consolidation
def p1(c, end=0.2, sizes=(10, 20, 40)):
    runs = [c.run("P1_terzaghi", {"Constants/cells": n, "Constants/End": "%g*t_1" % end}) for n in sizes]
    # Measured with two points a cell: 0.03 % of q at 40 cells, an inertia term of 1e-4 and less.
    c.below("pressure (rms over cells, all times)", runs[-1].error("pressure", "L2"), 3e-3)
    c.below("settlement, Linf", runs[-1].error("settlement", "Linf"), 5e-3)
    for i, T in enumerate((0.02, 0.1, 0.2)):
        c.order("pressure at T = %g" % T, sizes, [run.errors_at_times("pressure")[i] for run in runs], 1.8)
    c.order("settlement", sizes, [run.error("settlement", "L2") for run in runs], 1.8)
    c.below("fluid mass", runs[-1].summary["balance"]["fluid_mass"], 1e-12)


def p1_late(c):
    run = c.run("P1_terzaghi", {
        "Constants/End": "t_1", "References/pressure/Times": "0.02*t_1, 0.1*t_1, 0.2*t_1, 0.5*t_1, t_1",
        "References/pressure/Columns": ", ".join("p(T=%g) [Pa]" % T for T in (0.02, 0.1, 0.2, 0.5, 1))})
    for T, error in zip((0.02, 0.1, 0.2, 0.5, 1), run.errors_at_times("pressure")):
        c.below("pressure (rms over cells) at T = %g" % T, error, 3e-3)
    c.below("settlement, Linf", run.error("settlement", "Linf"), 5e-3)


def p1_3d(c):
    run = c.run("P1_terzaghi_3d")
    flat = c.run("P1_terzaghi", {"Constants/cells": 20})
    c.below("pressure (rms over cells, all times)", run.error("pressure", "L2"), 1.2e-2)
    c.below("settlement, Linf", run.error("settlement", "Linf"), 2e-2)
    # The third dimension must not take part.
    difference = abs(run.error("pressure", "L2") / flat.error("pressure", "L2") - 1.)
    c.below("error of the pressure against that in two dimensions", difference, 0.05)


def p2(c, sizes=(10, 20, 40)):
    runs = [c.run("P2_selfweight_consolidation", {"Constants/cells": n}) for n in sizes]
    c.below("pressure (rms over cells)", runs[-1].error("pressure", "L2"), 3e-3)
    c.below("displacement, Linf", runs[-1].error("displacement", "Linf"), 5e-3)
    c.order("pressure", sizes, [run.error("pressure", "L2") for run in runs], 1.8)
    run = c.run("P2_selfweight_consolidation", {
        "Constants/H": 1, "Constants/cells": 10, "Constants/K_f": 2.2e8, "Constants/g": 1e-3, "Constants/End": "7*t_1"})
    c.below("pressure in the end, hydrostatic", run.error("hydrostatic", "Linf"), 1e-6)


def p2_soft(c):
    """With a fluid only four times as stiff as the form needs, rest must stay rest for a long time, too."""
    for cells in (10, 11):
        run = c.run("P2_selfweight_consolidation", {
            "Constants/H": 1, "Constants/cells": cells, "Constants/K_f": 2.2e7, "Constants/g": 1e-3,
            "Constants/End": "7*t_1"}, may_fail=True)
        c.note("%d cells, completes" % cells, run.completed, run.message)
        if run.completed:
            # The largest speed while the column settles is 1e-8 m/s.
            c.below("%d cells, speed in the end" % cells, run.table("statistics.csv")["largest speed"][-1], 1e-10)


# ---------------------------------------------------------------------------------------------------------- dynamics
def d2(c):
    run = c.run("D2_step")
    c.below("pressure at the base, L1", run.error("pressure at the base", "L1"), 5e-2)
    c.below("pressure in the middle, L1", run.error("pressure in the middle", "L1"), 5e-2)
    c.below("displacement of the top, L1", run.error("displacement of the top", "L1"), 5e-2)
    settings = {"Seepage inertia": "false"}
    for name in ("pressure at the base", "pressure in the middle", "displacement of the top"):
        settings["References/%s/File" % name] = "reference/data/D2_step_up0.csv"
    run = c.run("D2_step", settings)
    c.below("without seepage inertia: pressure in the middle, L1", run.error("pressure in the middle", "L1"), 5e-2)
    # The two forms differ by more than the error: the code solves the one that was asked for.
    wrong = c.run("D2_step", {"Seepage inertia": "false"})
    c.above("the other form's reference, over the own", wrong.error("pressure in the middle", "L1") /
            run.error("pressure in the middle", "L1"), 1.5)


def d3(c, sizes=(20, 40, 80)):
    runs = [c.run("D3_ramp", {"Constants/cells": n}) for n in sizes]
    c.below("pressure (rms over cells, all times)", runs[-1].error("pressure", "L2"), 1e-2)
    c.below("displacement of the top for t >= 0.1 s, Linf", runs[-1].error("displacement of the top", "Linf"), 1e-2)
    c.below("pressure at the base, Linf", runs[-1].error("pressure at the base", "Linf"), 1e-2)
    # At 0.03 s the drained layer is a cell thick.
    for i, t in ((1, 0.1), (2, 0.2), (3, 0.4)):
        c.order("pressure at %g s" % t, sizes, [run.errors_at_times("pressure")[i] for run in runs], 1.8)
    # Darcy's dissipation is the only one; the energy balance must close.
    c.below("energy balance", runs[-1].summary["balance"]["energy"], 1e-2)
    c.below("fluid mass", runs[-1].summary["balance"]["fluid_mass"], 1e-12)


def d3_3d(c):
    run = c.run("D3_ramp_3d")
    flat = c.run("D3_ramp", {"Constants/cells": 20, "Constants/End": 0.2, "References/pressure/Times": "0.03, 0.1, 0.2",
                             "References/pressure/Columns": "p(t=0.03 s) [Pa], p(t=0.1 s) [Pa], p(t=0.2 s) [Pa]"})
    for a, b, t in zip(run.errors_at_times("pressure"), flat.errors_at_times("pressure"), (0.03, 0.1, 0.2)):
        # The third dimension must not take part at all; errors.csv has ten digits.
        c.below("error of the pressure at %g s against 2-D" % t, abs(a / b - 1.), 1e-6)
    c.below("pressure at the base, Linf", run.error("pressure at the base", "Linf"), 1e-2)


def d5_eigenvalues(form):
    with open(os.path.join(TABLES, "D5_standing.csv")) as file:
        line = next(line for line in file if line.startswith("# eigenvalues (%s)" % form))
    values = [complex(v.strip()) for v in line.split("=")[1].replace("1/s", "").split(",")]
    wave, slow = next(v for v in values if v.imag > 0.), next(v for v in values if v.imag == 0.)
    return -wave.real, wave.imag, -slow.real


def d5(c, sizes=(10, 20, 40)):
    for form in ("up", "up0"):
        exact, errors = d5_eigenvalues(form), {}
        # The errors of space and time have opposite signs: the order is that of space, at a small step.
        for n, factor in [(20, 0.5)] + [(n, 0.1) for n in sizes]:
            settings = {"Constants/cells": n, "Explicit MPM/Step factor": factor,
                        "Seepage inertia": "true" if form == "up" else "false"}
            for name, column in (("velocity in the middle", "V_%s [m/s]"), ("pressure at the base", "P_%s [Pa]")):
                settings["References/%s/Columns" % name] = column % form
            run = c.run("D5_standing_wave", settings)
            p = run.table("probes.csv")
            found = fit_decay(p["time"], p["middle/velocity y"], exact)
            errors[n, factor] = [abs(a / b - 1.) for a, b in zip(found, exact)]
        c.below(form + ": imaginary part at 40 cells a wave length", errors[20, 0.5][1], 2e-3)
        c.below(form + ": real part", errors[20, 0.5][0], 2e-2)
        c.below(form + ": slow decay", errors[20, 0.5][2], 2e-2)
        for k, part in ((1, "imaginary part"), (0, "real part")):
            c.order("%s: %s" % (form, part), sizes, [errors[n, 0.1][k] for n in sizes], 1.8)


def g1(c):
    for offset in (0, 0.37):
        run = c.run("G1_rest", {"Constants/offset": offset})
        c.below("offset %g: displacement over height" % offset, run.error("displacement", "Linf"), 1e-6)
        c.below("offset %g: pressure" % offset, run.error("pressure", "Linf"), 1e-6)


# ------------------------------------------------------------------------------------------------ limits of the scheme
def n1_limit(c, k, formula):
    """Largest stable step, by bisection; unstable is what ends with an error or moves ten times as fast as it began."""
    def stable(factor):
        run = c.run("N1_timestep", {"Constants/k": k, "Constants/End": 1500. * formula * factor,
                                    "Explicit MPM/Step factor": factor}, may_fail=True)
        # The automatic step also allows for slivers at the surface, which full cells do not have.
        steps.append((factor, run.summary["dt"]["max"]))
        if not run.completed:
            return False
        return max(run.table("statistics.csv")["largest speed"]) < 1e-5

    steps = []
    low, high = 0.9, 4.
    if not stable(low):
        return 0.
    while high / low > 1.03:
        middle = math.sqrt(low * high)
        low, high = (middle, high) if stable(middle) else (low, middle)
    factor, dt = steps[0]
    return math.sqrt(low * high) / factor * dt


def n1(c, conductivities=(1e-6, 1e-4, 1e-2)):
    table = read_table(os.path.join(TABLES, "N1_timestep.csv"))
    for k, limit, formula in zip(table["k [m/s]"], table["up [s]"], table["formula up [s]"]):
        if k in conductivities:
            c.below("k = %g m/s: limit against that of the theory" % k, abs(n1_limit(c, k, formula) / limit - 1.), 0.1)


def n2(c):
    run = c.run("N2_ill_posed", may_fail=True)
    c.note("refused with exit code 1", run.code == 1, "exit code %d" % run.code)
    named = all(word in run.message for word in ("rock", "alpha^2 Q (1 - r) > r M", "Seepage inertia"))
    c.note("the message says what is wrong and what would be right", named and "\n" not in run.message, run.message[:60])
    run = c.run("N2_ill_posed", {"Seepage inertia": "false"}, may_fail=True)
    c.note("without seepage inertia it runs", run.completed, run.message)
    if run.completed:
        c.below("and does not grow", max(run.table("statistics.csv")["largest speed"]), 1.05e-3)


# ---------------------------------------------------------------------------------------------------------- parallel
def compare_tables(a, b):
    """Largest difference of two tables, relative to the largest value in any column of the same quantity and unit."""
    def unit(name):
        quantity = re.sub(r"^.*/", "", name)
        return re.sub(r"^.*\[", "[", quantity) if "[" in quantity else quantity

    rows_a, rows_b = read_table(a, text=True), read_table(b, text=True)
    if len(rows_a) != len(rows_b) or list(rows_a[0]) != list(rows_b[0]):
        return float("inf"), "shape"
    scale, worst = {}, (0., "")
    # Errors of balances are round-off, differences of equal numbers.
    names = [name for name in rows_a[0] if "error" not in name and name not in ("binding limit", "numerical dissipation [J]")]
    for name in names:
        values = [abs(float(row[name])) for row in rows_a if row[name]]
        scale[unit(name)] = max([scale.get(unit(name), 0.)] + values)
    for name in names:
        for p, q in zip(rows_a, rows_b):
            if (p[name] == "") != (q[name] == ""):
                return float("inf"), name
            if p[name] and scale[unit(name)] > 0.:
                difference = abs(float(p[name]) - float(q[name])) / scale[unit(name)]
                worst = max(worst, (difference, name))
    return worst


def parallel(c, ranks=(1, 2, 3)):
    scenes = {"S5_rigid_motion": {"Constants/End": 0.3, "Output/Pictures": "false"},
              "S1_bar_mode_3d": {"Constants/cells": 20, "Constants/End": "0.5*T"},
              "S2_bar_step": {"Constants/End": "2*L/c"},
              "D3_ramp": {"Constants/cells": 20, "Constants/End": 0.05, "References/pressure/Times": "0.03",
                          "References/pressure/Columns": "p(t=0.03 s) [Pa]",
                          "References/displacement of the top/Start": 0}}
    for scene, settings in scenes.items():
        runs = [c.run(scene, settings, ranks=n) for n in ranks]
        for n, run in zip(ranks[1:], runs[1:]):
            for table in ("statistics.csv", "probes.csv"):
                paths = [os.path.join(r.directory, table) for r in (runs[0], run)]
                if os.path.exists(paths[0]):
                    difference, column = compare_tables(*paths)
                    c.below("%s, %d ranks, %s (%s)" % (scene, n, table[:-4], column), difference, 1e-10)


# name: (function, labels, seconds on one core). 'quick' is a part of 'full'.
CASES = {
    "S1": (s1, ("quick", "full"), 5),
    "S1_3d": (s1_3d, ("quick", "full"), 1),
    "S2": (s2, ("quick", "full"), 1),
    "S3": (s3, ("quick", "full"), 1),
    "S4": (s4, ("quick", "full"), 3),
    "S5_patch": (s5_patch, ("quick", "full"), 2),
    "S5_rigid_motion": (s5_rigid_motion, ("quick", "full"), 1),
    "S5_rotation": (s5_rotation, ("quick", "full"), 1),
    "S5_shear": (s5_shear, ("quick", "full"), 1),
    "P1": (p1, ("quick", "full"), 5),
    "P1_late": (p1_late, ("full",), 20),
    "P1_3d": (p1_3d, ("full",), 10),
    "P2": (p2, ("quick", "full"), 4),
    "P2_soft_fluid": (p2_soft, ("full",), 2),
    "D2": (d2, ("quick", "full"), 2),
    "D3": (d3, ("quick", "full"), 2),
    "D3_fine": (lambda c: d3(c, sizes=(40, 80, 160)), ("full",), 15),
    "D3_3d": (d3_3d, ("quick", "full"), 1),
    "D5": (d5, ("quick", "full"), 3),
    "G1": (g1, ("quick", "full"), 1),
    "N1": (n1, ("quick", "full"), 8),
    "N1_all": (lambda c: n1(c, (1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1)), ("full",), 20),
    "N2": (n2, ("quick", "full"), 1),
    "parallel": (parallel, ("quick", "full"), 15),
}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--peat", help="the executable")
    parser.add_argument("--case", action="append", help="one of: " + ", ".join(CASES))
    parser.add_argument("--ranks", default="", help="run on so many ranks; of 'parallel' a list, e.g. 1,2,3")
    parser.add_argument("--list", metavar="LABEL", help="print the names of the cases with this label")
    parser.add_argument("--keep", metavar="DIR", help="leave the results there")
    arguments = parser.parse_args()
    if arguments.list:
        print("\n".join(name for name, (_, labels, _) in CASES.items() if arguments.list in labels))
        return 0
    if not arguments.peat or not arguments.case:
        parser.error("--peat and --case are needed, or --list")
    unknown = [name for name in arguments.case if name not in CASES]
    if unknown:
        parser.error("no case '%s'; there are %s" % (unknown[0], ", ".join(CASES)))
    ranks = [int(n) for n in arguments.ranks.split(",") if n]

    failed = False
    for name in arguments.case:
        print(name, flush=True)
        context = Context(arguments.peat, ranks[0] if len(ranks) == 1 else 1,
                          arguments.keep and os.path.join(arguments.keep, name))
        try:
            if name == "parallel":
                parallel(context, ranks if len(ranks) > 1 else (1, 2, 3))
            else:
                CASES[name][0](context)
        except Stop:
            pass
        finally:
            if not arguments.keep:
                shutil.rmtree(context.root, ignore_errors=True)
        failed = failed or context.failed
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
