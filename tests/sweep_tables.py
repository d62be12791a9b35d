#!/usr/bin/env python3
"""The tables of error against time in doc/benchmarks.md: tests/sweep_tables.py [--peat build/peat] [--only TEXT] [--write]

Runs each command `peat sweep ...` of that page (or those that contain TEXT) and prints its results as a table: error and time
loop of each run, `*` where it is on the Pareto front, the order of convergence fitted to all meshes, and what 1 % costs,
between two meshes by a power law. --write puts the tables into the page, below their commands.
"""
import argparse
import csv
import math
import os
import shlex
import subprocess
import tempfile

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.join(HERE, "..")
PAGE = os.path.join(ROOT, "doc", "benchmarks.md")


def commands(lines):
    """(line after the command, its words), for each command of the page."""
    found, i = [], 0
    while i < len(lines):
        if lines[i].startswith("    peat sweep "):
            text = lines[i].strip()
            while text.endswith("\\"):
                i += 1
                text = text[:-1] + lines[i].strip()
            found.append((i + 1, shlex.split(text)[1:]))
        i += 1
    return found


def error_text(error):
    return "%.2g %%" % (100. * error)


def time_text(seconds):
    return "%.2g ms" % (1e3 * seconds) if seconds < 0.1 else "%.2g s" % seconds


def order(points):
    x, y = [math.log(p[0]) for p in points], [math.log(p[1]) for p in points]
    mx, my = sum(x) / len(x), sum(y) / len(y)
    return -sum((a - mx) * (b - my) for a, b in zip(x, y)) / sum((a - mx)**2 for a in x)


def cost(points, target=1e-2):
    """Time for an error, or None if no mesh comes to it."""
    if points and points[0][1] <= target:
        return points[0][2]
    for (_, e, t), (_, finer, longer) in zip(points, points[1:]):
        if finer <= target:
            return t * (longer / t)**(math.log(e / target) / math.log(e / finer))
    return None


def table(rows):
    """The first setting that varies makes the columns, the others the lines."""
    names = list(rows[0])
    first, *others = names[2:names.index("error")]
    values = list(dict.fromkeys(row[first] for row in rows if row[first]))
    finer = 1. if first.endswith("cells") else -1.   # numbers of cells, or sizes
    values.sort(key=lambda v: finer * float(v))
    groups = {}
    for row in rows:
        if row["state"] != "refused":   # what has no meaning together
            groups.setdefault(", ".join(row[name] for name in others if row[name]), {}).setdefault(row[first], row)
    text = ["| | %s | order | 1 %% costs |" % " | ".join(values), "|---" * (len(values) + 3) + "|"]
    for name, runs in groups.items():
        cells, points = [], []
        for value in values:
            row = runs.get(value, {"state": ""})
            if row["state"] != "done":
                cells.append(row["state"])
            elif row["error"]:
                error, seconds = float(row["error"]), float(row["time loop [s]"])
                points.append((float(value)**finer, error, seconds))
                cells.append("%s, %s%s" % (error_text(error), time_text(seconds),
                                           " *" if row["Pareto front"] == "yes" else ""))
            else:
                cells.append("the finest, %s" % time_text(float(row["time loop [s]"])))
        fits = len(points) > 1 and all(p[1] > 0. for p in points)
        seconds = cost(points)
        text.append("| %s | %s | %s | %s |" % (name, " | ".join(cells), "%.1f" % order(points) if fits else "",
                                               "-" if seconds is None else time_text(seconds)))
    return text


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--peat", default=os.path.join(ROOT, "build", "peat"))
    parser.add_argument("--only", default="")
    parser.add_argument("--write", action="store_true")
    arguments = parser.parse_args()
    with open(PAGE) as file:
        lines = file.read().split("\n")
    # From the last to the first, so that what is found stays where it is.
    for end, words in reversed(commands(lines)):
        if arguments.only not in " ".join(words):
            continue
        with tempfile.TemporaryDirectory() as directory:
            subprocess.run([os.path.abspath(arguments.peat)] + words + ["--output", directory], check=True, cwd=ROOT,
                           stdout=subprocess.DEVNULL)
            with open(os.path.join(directory, "sweep.csv")) as file:
                text = table(list(csv.DictReader(file)))
        print(" ".join(words) + "\n\n" + "\n".join(text) + "\n", flush=True)
        if arguments.write:
            after = end
            while after < len(lines) and (not lines[after] or lines[after].startswith("|")):
                after += 1
            lines[end:after] = [""] + text + [""]
            with open(PAGE, "w") as file:
                file.write("\n".join(lines))


if __name__ == "__main__":
    main()
