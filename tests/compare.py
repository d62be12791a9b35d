#!/usr/bin/env python3
"""`peat compare`: its files, and its numbers against a computation of their own.

    compare.py --peat build/peat [--keep DIR]

Prints what was checked and ends with exit code 1 if something is not as it should be.
"""
import argparse
import csv
import json
import math
import os
import shutil
import subprocess
import sys
import tempfile

HERE = os.path.dirname(os.path.abspath(__file__))
COLUMN = os.path.join(HERE, "..", "prm", "verification", "D3_ramp.prm")  # references of two kinds, three probes
BLOCK = os.path.join(HERE, "bad_input", "good.prm")  # two bodies, one of them dry, references of all kinds
GIMP, Q1 = "Explicit MPM/Basis=gimp", "Explicit MPM/Basis=q1"
FILES = ("compare.csv", "samples.csv", "references.csv", "summary.json", "log.txt")
RUN_FILES = ("parameters.prm", "statistics.csv", "probes.csv", "summary.json", "log.txt", "errors.csv")


class Checks:
    def __init__(self):
        self.failed = 0

    def __call__(self, what, good):
        print(("ok      " if good else "FAILED  ") + what)
        self.failed += not good


class Comparison:
    """One `peat compare` and what it wrote."""

    def __init__(self, peat, scene, directory, first=GIMP, second=Q1, settings=(), ranks=1, environment=(),
                 code=0):
        command = [peat, "compare", scene, "--quiet", "--output", directory]
        for setting in ("Compare/First=" + first, "Compare/Second=" + second) + tuple(settings):
            command += ["--set", setting]
        if ranks > 1:
            command = ["mpirun", "-np", str(ranks)] + command
        own = dict(os.environ, OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1",
                   OMPI_MCA_rmaps_base_oversubscribe="1", OMP_NUM_THREADS="1")
        own.update(environment)
        done = subprocess.run(command, capture_output=True, text=True, env=own)
        if done.returncode != code:
            sys.exit("%s: exit code %d\n%s" % (" ".join(command), done.returncode, done.stderr))
        self.directory, self.output = directory, done.stdout + done.stderr
        self.summary = json.load(open(self.path("summary.json")))
        self.rows = self.table("compare.csv")
        self.pair = "%s-%s" % tuple(reversed(self.summary["methods"]))

    def path(self, *names):
        return os.path.join(self.directory, *names)

    def exists(self, *names):
        return os.path.exists(self.path(*names)) and os.path.getsize(self.path(*names)) > 0

    def table(self, *names):
        with open(self.path(*names), newline="") as file:
            return list(csv.DictReader(file))

    def row(self, kind, name, field, runs=None):
        found = [r for r in self.rows if (r["kind"], r["name"], r["field"], r["runs"]) ==
                 (kind, name, field, runs or self.pair)]
        return found[0] if len(found) == 1 else None


def close(a, b, tolerance):
    return abs(a - b) <= tolerance * max(abs(a), abs(b), 1e-300)


def time_weights(times, from_start):
    """Half the way to the neighbours."""
    weights = []
    for k, time in enumerate(times):
        before = times[k - 1] if k > 0 else (0.0 if from_start else time)
        after = times[k + 1] if k + 1 < len(times) else time
        weights.append(0.5 * (after - before))
    return weights


def components(field):
    """The whole quantity of a field in 2-D: names and how often each counts."""
    if field.startswith("effective stress"):
        return [("effective stress " + c, 2.0 if c == "xy" else 1.0) for c in ("xx", "yy", "zz", "xy")]
    if " " in field:
        return [(field.split()[0] + " " + c, 1.0) for c in "xy"]
    return [(field, 1.0)]


def norms(pairs):
    """Of (weight, value, value, squares of both magnitudes): relative L2, relative Linf."""
    total = sum(p[0] for p in pairs)
    L2 = math.sqrt(sum(p[0] * (p[2] - p[1]) ** 2 for p in pairs) / total)
    Linf = max(abs(p[2] - p[1]) for p in pairs)
    scale_L2 = math.sqrt(max(sum(p[0] * p[3][r] for p in pairs) for r in (0, 1)) / total)
    scale_Linf = math.sqrt(max(max(p[3]) for p in pairs))
    return L2 / scale_L2, Linf / scale_Linf


def from_samples(comparison, field, unit, bodies):
    """Relative L2, relative Linf, number compared, number left out of a field from samples.csv."""
    rows = [r for r in comparison.table("samples.csv") if r["body"] in bodies]
    planes = comparison.summary["view"]["planes"]
    times = sorted({float(r["time [s]"]) for r in rows})
    weight = dict(zip(times, time_weights(times, True)))
    names = comparison.summary["methods"]
    quantity = components(field)
    pairs, n_out = [], 0
    for r in rows:
        size = 1.0
        for d, axis in enumerate("ij"):
            i = int(r["cell " + axis])
            size *= planes[d][i + 1] - planes[d][i]
        volumes = [float(r[n + "/volume [m^2]"] or 0) for n in names]
        if min(volumes) < 0.5 * size * (1 - 1e-9):
            n_out += 1
            continue
        texts = [[r["%s/%s [%s]" % (n, f, unit)] for f, _ in quantity] for n in names]
        if "" in texts[0] + texts[1]:
            continue
        squares = [sum(m * float(t) ** 2 for t, (_, m) in zip(row, quantity)) for row in texts]
        values = [float(r["%s/%s [%s]" % (n, field, unit)]) for n in names]
        pairs.append((weight[float(r["time [s]"])] * 0.5 * sum(volumes), values[0], values[1], squares))
    return norms(pairs) + (len(pairs), n_out)


def from_probes(comparison, probe, field, unit):
    """Relative L2 and Linf from the two probes.csv, which have the same times."""
    tables = [comparison.table(name, "probes.csv") for name in comparison.summary["methods"]]
    times = [float(r["time [s]"]) for r in tables[0]]
    weights = time_weights(times, False)
    pairs = []
    for w, *rows in zip(weights, *tables):
        values = [[float(r["%s/%s [%s]" % (probe, f, unit)]) for f, _ in components(field)] for r in rows]
        squares = [sum(m * v ** 2 for v, (_, m) in zip(row, components(field))) for row in values]
        k = [f for f, _ in components(field)].index(field)
        pairs.append((w, values[0][k], values[1][k], squares))
    return norms(pairs)


def check_files(check, comparison, with_report):
    for name in FILES:
        check("there is " + name, comparison.exists(name))
    for run in comparison.summary["methods"]:
        for name in RUN_FILES:
            check("there is %s/%s" % (run, name), comparison.exists(run, name))
    check("quiet says nothing", comparison.output == "")
    if with_report:
        check("there is report.html", comparison.exists("report.html"))
        page = open(comparison.path("report.html"), encoding="utf-8").read()
        check("the page has plots and stands alone", page.count("<img") >= 4 and page.count('src="data:') == page.count("<img"))
        check("the page has every sentence", page.count("<li>") == len(comparison.summary["findings"]))
        check("nothing is left of its making", not comparison.exists("report.log"))


def check_numbers(check, comparison, fields, groups):
    """compare.csv and summary.json against samples.csv, which holds nine digits."""
    for field, unit in fields:
        for name, bodies in groups:
            row = comparison.row("cells", name, field)
            mine = from_samples(comparison, field, unit, bodies)
            # Of nine digits each value is known to 5e-9 at the least; so is a difference of two to twice that.
            alike = row and all(close(float(row["relative " + norm]), mine[k], 1e-4) or
                                abs(float(row["relative " + norm]) - mine[k]) < 1e-8
                                for k, norm in ((0, "L2"), (1, "Linf")))
            good = alike and int(row["compared"]) == mine[2]
            check("%s of %s: L2 %.4g, Linf %.4g from samples.csv" % (field, name or "all bodies", *mine[:2]), bool(good))
            if not name:
                entry = comparison.summary["compare"][field]
                check("... and in summary.json", close(entry["relative_L2"], float(row["relative L2"]), 1e-8))
                check("... left out are %d" % mine[3], int(row["left out"]) == mine[3])


def check_references(check, comparison):
    """The differences from references are those that the runs find themselves."""
    for run in comparison.summary["methods"]:
        errors = json.load(open(comparison.path(run, "summary.json")))["errors"]
        for name, entry in errors.items():
            row = [r for r in comparison.rows if r["runs"] == run + "-reference" and r["name"] == name]
            if entry["relative_L2"] is None:  # the reference is zero everywhere, so nothing can be relative to it
                good = len(row) == 1 and row[0]["relative L2"] == "" and close(float(row[0]["L2"]), entry["L2"], 1e-8)
            else:
                good = len(row) == 1 and close(float(row[0]["relative L2"]), entry["relative_L2"], 1e-8)
            check("%s against the reference '%s'" % (run, name), good)


def check_same(check, comparison):
    """A run compared with itself."""
    numbers = [float(r[key]) for r in comparison.rows if r["runs"] == comparison.pair
               for key in ("L2", "Linf") if r[key]]
    check("%d differences of a run from itself are zero" % len(numbers), len(numbers) > 20 and max(numbers) == 0.0)
    check("... and no sentence says otherwise", not [s for s in comparison.summary["findings"] if "the runs" in s])
    check("... in directories of their own", comparison.summary["methods"] == ["q1_1", "q1_2"])


def check_ranks(check, one, two):
    """Two ranks give the differences of one, up to round-off of the values that are subtracted."""
    worst = 0.0
    for a, b in zip(one.rows, two.rows):
        if a["above tolerance"] in ("", "negligible"):
            continue
        for norm in ("L2", "Linf"):
            worst = max(worst, abs(float(a["relative " + norm]) - float(b["relative " + norm])))
    check("one rank and two agree: relative differences change by %.1e" % worst, len(one.rows) == len(two.rows) and worst < 1e-8)
    check("... and count the same cells", [r["compared"] for r in one.rows] == [r["compared"] for r in two.rows])


def check_times(check, peat, root):
    times = Comparison(peat, COLUMN, os.path.join(root, "logarithmic"), settings=(
        "Constants/cells=10", "Compare/Samples=5", "Compare/Spacing=logarithmic", "Compare/First sample=4e-4",
        "References/pressure/Times=0.4", "References/pressure/Columns=p(t=0.4 s) [Pa]")).summary["sample_times"]
    expected = [4e-4 * 1000**(k / 4) for k in range(5)]
    check("sample times are spaced by factors", len(times) == 5 and all(close(a, b, 1e-9) for a, b in zip(times, expected)))


def check_early_end(check, peat, root, with_report):
    """The second run becomes unstable: exit code 2, and a report up to there."""
    early = Comparison(peat, COLUMN, os.path.join(root, "early"), Q1, "Explicit MPM/Step factor=4",
                       ("Constants/cells=10", "Compare/Samples=400"), code=2)
    summary, last = early.summary, early.summary["simulated_time"]
    check("the run that stopped is named", summary["problems"][0] == "" and "'Step factor' 4" in summary["problems"][1] and
          "run '4'" in early.output)
    check("the report ends before the run does", 0. < last < 0.4 and close(last, summary["sample_times"][-1], 1e-9))
    check("it has numbers", bool(early.row("cells", "", "pressure")) and early.exists("samples.csv"))
    if with_report:
        check("the page says so", "ended early" in open(early.path("report.html")).read())


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--peat", default=os.path.join(HERE, "..", "build", "peat"), help="the program")
    parser.add_argument("--keep", help="leave the results in this directory")
    options = parser.parse_args()
    peat = os.path.abspath(options.peat)
    root = options.keep or tempfile.mkdtemp(prefix="peat-compare-")
    check = Checks()
    column = ("Constants/cells=16", "Compare/Samples=7")

    with_report = any(subprocess.run([python, "-c", "import matplotlib"], capture_output=True).returncode == 0
                      for python in ("python3", "/usr/bin/python3") if shutil.which(python))
    one = Comparison(peat, COLUMN, os.path.join(root, "column"), settings=column)
    check_files(check, one, with_report)
    # 7 equally spaced times and those of the reference, of which the end is one of both.
    check("the sample times are those of the file", len(one.summary["sample_times"]) == 7 + 3)
    check_numbers(check, one, (("pressure", "Pa"), ("displacement y", "m"), ("velocity y", "m/s"),
                               ("effective stress yy", "Pa")), (("", ["column"]),))
    check_references(check, one)
    for field, unit in (("pressure", "Pa"), ("velocity y", "m/s")):
        row, mine = one.row("probe", "top", field), from_probes(one, "top", field, unit)
        check("%s at a probe: L2 %.4g, Linf %.4g from probes.csv" % ((field,) + mine), bool(row) and
              close(float(row["relative L2"]), mine[0], 1e-6) and close(float(row["relative Linf"]), mine[1], 1e-6))
    two = Comparison(peat, COLUMN, os.path.join(root, "column_2"), settings=column, ranks=2)
    check_ranks(check, one, two)
    check_same(check, Comparison(peat, COLUMN, os.path.join(root, "same"), Q1, Q1, column))

    block = Comparison(peat, BLOCK, os.path.join(root, "block"), settings=("Compare/Samples=4",),
                       environment={"PEAT_PYTHON": "/no/such/python"})
    check_files(check, block, False)
    check("without Python there is no page, and the numbers are there", not block.exists("report.html") and
          "python3" in open(block.path("log.txt")).read())
    everything = ["ground", "block"]
    check_numbers(check, block, (("effective stress yy", "Pa"), ("velocity y", "m/s")),
                  (("", everything), ("ground", everything[:1]), ("block", everything[1:])))
    check("a dry body has no pressure to compare", not block.row("cells", "block", "pressure") and
          bool(block.row("cells", "ground", "pressure")))
    check_references(check, block)

    check_times(check, peat, root)
    check_early_end(check, peat, root, with_report)

    if not options.keep:
        shutil.rmtree(root)
    print("%d failed" % check.failed)
    return 1 if check.failed else 0


if __name__ == "__main__":
    sys.exit(main())
