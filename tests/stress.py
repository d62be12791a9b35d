#!/usr/bin/env python3
"""Several hundred short runs over the corners of what can be asked for. Each must end sound or be refused with a reason
before it runs; a step above the stable one must blow up and be caught.

    stress.py --peat build/peat [--few | --share N] [--known FILE] [--jobs N] [--random N] [--seed N] [--only TEXT]
              [--output DIR]

Scenes: stress/*.prm; what is varied: stress_matrix.py; what sound means: stress_judge.py. Writes stress.csv and stress.md
into DIR, prints what is not sound, and ends with exit code 1 if there is any. A file of known failures (name and cause of
each, as doc/stability.md lists them) leaves those out of the exit code, and has to lose those that have become sound.
"""
import argparse
import csv
import math
import os
import shutil
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor

from scene_tools import Run
from stress_judge import alternation, judge
from stress_matrix import all_cases, few_cases, some_of

HERE = os.path.dirname(os.path.abspath(__file__))
SECONDS = 300
NUMBERS = ("energy", "energy at the end", "momentum", "fluid mass", "checkerboard")


class Runner:
    def __init__(self, peat, root):
        self.peat, self.root = os.path.abspath(peat), root

    def scene(self, case):
        """The file of a scene with the law of the case."""
        law = case.settings.get("law")
        path = os.path.join(HERE, "stress", case.scene + ".prm")
        if not law:
            return path
        changed = os.path.join(self.root, "%s %s.prm" % (case.scene, law))
        if not os.path.exists(changed):
            with open(path) as file, open(changed, "w") as copy:
                copy.write(file.read().replace("linear elastic", law))
        return changed

    def __call__(self, number, case):
        directory = os.path.join(self.root, "%04d" % number)
        command = [self.peat, "run", self.scene(case), "--quiet", "--output", directory] + case.words()
        # With this Open MPI starts no daemon for each program, but puts what it needs into TMPDIR.
        os.mkdir(directory)
        environment = dict(os.environ, OMPI_MCA_ess_singleton_isolated="1", TMPDIR=directory, OMP_NUM_THREADS="1")
        begin = time.time()
        try:
            done = subprocess.run(command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
                                  universal_newlines=True, timeout=SECONDS)
            run = Run(directory, done.returncode, done.stderr.strip())
        except subprocess.TimeoutExpired:
            run = Run(directory, None, "")
        verdict = judge(case, run)
        seconds, steps = time.time() - begin, run.summary.get("steps", "")
        shutil.rmtree(directory, ignore_errors=True)
        return verdict, seconds, steps


def measures_are_right():
    """The measure of a checkerboard finds what alternates, and nothing in a smooth field."""
    cells = [(i, j) for i in range(12) for j in range(12)]
    smooth = {(i, j): math.cos(math.pi * (i + 0.5) / 12) * (1 - (j / 12)**2) for i, j in cells}
    signs = {"x": lambda i, j: i, "y": lambda i, j: j, "xy": lambda i, j: i + j}
    found = [alternation({cell: smooth[cell] + 0.02 * (-1)**sign(*cell) for cell in cells})[name] for name, sign in signs.items()]
    return max(map(abs, alternation(smooth).values())) < 1e-3 and all(abs(amplitude - 0.02) < 1e-3 for amplitude in found)


def write_csv(path, cases, results):
    with open(path, "w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["scene", "group", "settings", "state", "reason"] + list(NUMBERS) + ["steps", "seconds"])
        for case, (verdict, seconds, steps) in zip(cases, results):
            writer.writerow([case.scene, case.group, "; ".join("%s=%s" % item for item in case.settings.items()), verdict.state,
                             verdict.reason] + ["%.3g" % verdict.numbers[n] if n in verdict.numbers else "" for n in NUMBERS] +
                            [steps, "%.2f" % seconds])


def markdown(cases, results):
    """A line for each group, then one for each run that is not sound."""
    groups = {}
    for case, (verdict, _, _) in zip(cases, results):
        groups.setdefault((case.scene, case.group), []).append((case, verdict))
    lines = ["| scene | varied | runs | sound | refused | caught | failed |", "|---|---|---|---|---|---|---|"]
    for (scene, group), found in groups.items():
        count = lambda state: sum(verdict.state == state for _, verdict in found)
        lines.append("| %s | %s | %d | %d | %d | %d | %d |" % (scene, group, len(found), count("sound"), count("refused"),
                                                            count("caught"), count("FAILED")))
    bad = [(case, verdict) for case, (verdict, _, _) in zip(cases, results) if not verdict.is_good]
    if bad:
        lines += ["", "| scene | settings | what is wrong |", "|---|---|---|"]
        lines += ["| %s | %s | %s |" % (case.scene, ", ".join("%s=%s" % item for item in case.settings.items()) or "base",
                                        verdict.reason.replace("|", "/").replace("\n", " ")[:220]) for case, verdict in bad]
    return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--peat", required=True, help="the program")
    parser.add_argument("--few", action="store_true", help="a small sample")
    parser.add_argument("--share", type=int, default=1, metavar="N", help="one of N runs in each group")
    parser.add_argument("--known", metavar="FILE", help="failures that are known")
    parser.add_argument("--jobs", type=int, default=2, help="runs at a time")
    parser.add_argument("--random", type=int, default=120, help="samples at random of each scene")
    parser.add_argument("--seed", type=int, default=1, help="of the samples")
    parser.add_argument("--only", default="", help="only cases whose scene, group or settings contain this")
    parser.add_argument("--output", help="directory for stress.csv and stress.md")
    arguments = parser.parse_args()
    everything = all_cases(arguments.random, arguments.seed)
    cases = few_cases() if arguments.few else some_of(everything, arguments.share)
    cases = [case for case in cases if arguments.only in case.name or arguments.only in case.scene + ": " + case.group]

    if not measures_are_right():
        sys.exit("the measure of checkerboards is wrong")
    known = {}
    if arguments.known:
        with open(arguments.known, newline="") as file:
            known = {row["case"]: row["cause"] for row in csv.DictReader(file)}
        unknown = set(known) - {case.name for case in everything}
        if unknown:
            sys.exit("the list of known failures has what is not in the matrix: " + "; ".join(sorted(unknown)))
        # What only takes long is found out by the whole matrix, not by its samples.
        if arguments.share > 1:
            cases = [case for case in cases if not known.get(case.name, "").startswith("slow")]
    root = tempfile.mkdtemp(prefix="peat-stress-")
    begin = time.time()
    results, n_bad, n_known = [], 0, 0
    try:
        runner = Runner(arguments.peat, root)
        with ThreadPoolExecutor(arguments.jobs) as pool:
            for case, result in zip(cases, pool.map(runner, range(len(cases)), cases)):
                results.append(result)
                if case.name in known:
                    n_known += 1
                    if result[0].is_good:
                        n_bad += 1
                        print("SOUND   %s\n        is in the list of known failures: %s" % (case.name, known[case.name]), flush=True)
                elif not result[0].is_good:
                    n_bad += 1
                    print("FAILED  %s\n        %s" % (case.name, result[0].reason), flush=True)
                elif arguments.few:
                    print("%-8s%s  %s" % (result[0].state, case.name, result[0].reason), flush=True)
    finally:
        shutil.rmtree(root, ignore_errors=True)
    if arguments.output:
        os.makedirs(arguments.output, exist_ok=True)
        write_csv(os.path.join(arguments.output, "stress.csv"), cases, results)
        with open(os.path.join(arguments.output, "stress.md"), "w") as file:
            file.write(markdown(cases, results))
    print("%d runs, %d known failures, %d others not as they should be, %.0f s" % (
        len(cases), n_known, n_bad, time.time() - begin))
    return 1 if n_bad else 0


if __name__ == "__main__":
    sys.exit(main())
