"""What the scripts that run scenes share: running and reading, bounds, a little arithmetic, the command line."""
import argparse
import base64
import bisect
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

    def points(self, body, picture=-1):
        """Fields of a body's points in the last picture, or another one: name -> list of tuples."""
        folder = os.path.join(self.directory, "pictures")
        names = sorted(f for f in os.listdir(folder) if f.startswith(body + "-"))
        return read_vtu(os.path.join(folder, names[picture]))


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


def without(text, name):
    """A parameter file without a subsection (of its top or within another)."""
    lines, depth, skipped_from = [], 0, None
    for line in text.splitlines():
        words = line.split("#")[0].split()
        if words[:1] == ["subsection"]:
            depth += 1
            if skipped_from is None and " ".join(words[1:]) == name:
                skipped_from = depth
        if skipped_from is None:
            lines.append(line)
        if words[:1] == ["end"]:
            if skipped_from == depth:
                skipped_from = None
            depth -= 1
    return "\n".join(lines) + "\n"


class Context:
    """What a case works with: it runs scenes and notes what it finds."""

    def __init__(self, peat, ranks, keep):
        """ranks: a list; one number is for all runs, several are what cases of several ranks take."""
        self.peat, self.keep = os.path.abspath(peat), keep
        self.ranks = ranks[0] if len(ranks) == 1 else 1
        self.rank_counts = ranks if len(ranks) > 1 else (1, 2, 3)
        self.root = keep or tempfile.mkdtemp(prefix="peat-scenes-")
        self.n_runs, self.failed, self.lines = 0, False, []

    def run(self, scene, settings=None, ranks=None, may_fail=False):
        """Scene: file from prm/verification on, without .prm; settings: {"Section/Key": value}."""
        self.n_runs += 1
        directory = os.path.join(self.root, "%03d_%s" % (self.n_runs, os.path.basename(scene)))
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
    """Fit y = (A cos wt + B sin wt) exp(-a t) + C exp(-c t); from first guesses (a, w, c) to the best values.

    Without c: the first of the two terms alone.
    """
    def residual(p):
        a, w = p[:2]
        columns = [[math.exp(-a * s) * math.cos(w * s) for s in t], [math.exp(-a * s) * math.sin(w * s) for s in t]]
        columns += [[math.exp(-c * s) for s in t] for c in p[2:]]
        return least_squares(columns, y)[1]

    p = list(rates)
    for _ in range(12):
        r = residual(p)
        columns = []
        for k in range(len(p)):
            step = 1e-6 * abs(p[k])
            q = p[:k] + [p[k] + step] + p[k + 1:]
            columns.append([(b - a) / step for a, b in zip(r, residual(q))])
        change = least_squares(columns, [-v for v in r])[0]
        p = [v + d for v, d in zip(p, change)]
        if max(abs(d / v) for v, d in zip(p, change)) < 1e-10:
            break
    return p


def standing_wave_rates(k, b=math.pi, E=1e7, nu=0.3, n=0.4, rho_s=2650., rho_f=1000., K_f=2.2e8, g=9.81):
    """Decay and frequency of the wave u = U(t) sin(b y), p = P(t) cos(b y) in saturated soil, and decay of what is left [1/s].

    Of U, P ~ exp(s t) in the u-p equations: rho s^2 U = -M b^2 U + b P, s P/Q = -K b^2 P + K rho_f b s^2 U - b s U. The
    values of D5_standing_wave.prm, with conductivities k for which there is a wave.
    """
    M, Q, K = E * (1. - nu) / ((1. + nu) * (1. - 2. * nu)), K_f / n, k / (rho_f * g)
    rho = n * rho_f + (1. - n) * rho_s
    c = [rho / Q, K * b * b * (rho - rho_f), b * b * (M / Q + 1.), M * K * b**4]
    size = max(c[1] / c[0], math.sqrt(c[2] / c[0]), (c[3] / c[0])**(1. / 3.))
    roots = [size * (0.4 + 0.9j)**i for i in range(3)]
    for _ in range(200):
        for i in range(3):
            s = roots[i]
            change = (((c[0] * s + c[1]) * s + c[2]) * s + c[3]) / c[0]
            for j in range(3):
                if j != i:
                    change /= s - roots[j]
            roots[i] -= change
    wave, rest = max(roots, key=lambda s: s.imag), min(roots, key=lambda s: abs(s.imag))
    return -wave.real, wave.imag, -rest.real


def amplitude(t, y, w):
    c, _ = least_squares([[math.cos(w * s) for s in t], [math.sin(w * s) for s in t], [1.] * len(t)], y)
    return math.hypot(c[0], c[1])


def interpolate(x, xs, ys):
    k = min(max(1, bisect.bisect_left(xs, x)), len(xs) - 1)
    share = (x - xs[k - 1]) / (xs[k] - xs[k - 1])
    return (1. - share) * ys[k - 1] + share * ys[k]


# ------------------------------------------------------------------------------------------------------------- tables
ABSENT = ("", "nan")   # what a table has where there is no material or no contact


def compare_tables(a, b):
    """Largest difference of two tables, relative to the largest value in any column of the same quantity and unit."""
    def unit(name):
        return name[name.index("["):] if "[" in name else name.split("/")[-1]

    rows_a, rows_b = read_table(a, text=True), read_table(b, text=True)
    if len(rows_a) != len(rows_b) or list(rows_a[0]) != list(rows_b[0]):
        return float("inf"), "shape"
    scale, worst = {}, (0., "")
    # Errors of balances are round-off, differences of equal numbers.
    names = [name for name in rows_a[0] if "error" not in name and name not in ("binding limit", "numerical dissipation [J]")]
    for name in names:
        values = [abs(float(row[name])) for row in rows_a if row[name] not in ABSENT]
        scale[unit(name)] = max([scale.get(unit(name), 0.)] + values)
    # The momentum of bodies that move against each other is a difference.
    if {"[N s]", "[kg]", "[m/s]"} <= set(scale):
        scale["[N s]"] = max(scale["[N s]"], scale["[kg]"] * scale["[m/s]"])
    # And a moment about the centre of a body that is hit in the middle is nothing but round-off.
    if {"[N m]", "[N]", "[m]"} <= set(scale):
        scale["[N m]"] = max(scale["[N m]"], scale["[N]"] * scale["[m]"])
    for name in names:
        for p, q in zip(rows_a, rows_b):
            if (p[name] in ABSENT) != (q[name] in ABSENT):
                return float("inf"), name
            if p[name] not in ABSENT and scale[unit(name)] > 0.:
                difference = abs(float(p[name]) - float(q[name])) / scale[unit(name)]
                worst = max(worst, (difference, name))
    return worst


# ------------------------------------------------------------------------------------------------------- command line
def main(cases, description):
    """cases: {name: (function of a Context, labels, seconds on one core)}; returns the exit code."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--peat", help="the executable")
    parser.add_argument("--case", action="append", help="one of: " + ", ".join(cases))
    parser.add_argument("--ranks", default="", help="run on so many ranks; of cases of several ranks a list, e.g. 1,2,3")
    parser.add_argument("--list", metavar="LABEL", help="print the names of the cases with this label")
    parser.add_argument("--keep", metavar="DIR", help="leave the results there")
    arguments = parser.parse_args()
    if arguments.list:
        print("\n".join(name for name, (_, labels, _) in cases.items() if arguments.list in labels))
        return 0
    if not arguments.peat or not arguments.case:
        parser.error("--peat and --case are needed, or --list")
    unknown = [name for name in arguments.case if name not in cases]
    if unknown:
        parser.error("no case '%s'; there are %s" % (unknown[0], ", ".join(cases)))
    ranks = [int(n) for n in arguments.ranks.split(",") if n] or [1]

    failed = False
    for name in arguments.case:
        print(name, flush=True)
        context = Context(arguments.peat, ranks, arguments.keep and os.path.join(arguments.keep, name))
        try:
            cases[name][0](context)
        except Stop:
            pass
        finally:
            if not arguments.keep:
                shutil.rmtree(context.root, ignore_errors=True)
        failed = failed or context.failed
    return 1 if failed else 0
