#!/usr/bin/python3
"""What PEAT costs on one core: tests/benchmark.py [--peat build/peat] [--repeat 3] [--only NAME].

rates          million point-steps a second of prm/benchmarks/block_dry.prm and block_saturated.prm (512,000 points in 3-D,
               8 points a cell) for each basis and transfer, bytes of memory a point (whole process, and without what the
               program has with hardly any points), bytes a point-step that the algorithm has to move at least, and the share
               of the copy bandwidth of the machine that this makes
semi-implicit  a semi-implicit step of the saturated block in explicit ones, and the iterations of the pressure system
column         microseconds a step of the column of P1, 40 cells
background     a step of a block of 16^3 cells in a mesh of 80^3 cells over one in a mesh of 20^3
"""
import argparse
import json
import multiprocessing
import os
import subprocess
import tempfile
import time

import numpy as np

HERE = os.path.dirname(os.path.abspath(__file__))


def bandwidth():
    """Copy and triad of arrays that are larger than any cache [GB/s], bytes moved as STREAM counts them; numpy."""
    n = 20_000_000
    a, b, c = np.ones(n), np.ones(n), np.empty(n)
    best_copy = best_triad = float("inf")
    for _ in range(5):
        start = time.perf_counter()
        np.copyto(c, a)
        best_copy = min(best_copy, time.perf_counter() - start)
        start = time.perf_counter()
        np.multiply(b, 3.0, out=c)
        np.add(a, c, out=c)
        best_triad = min(best_triad, time.perf_counter() - start)
    return 16e-9 * n / best_copy, 40e-9 * n / best_triad


def least_bytes(saturated, gimp, affine):
    """What a point-step must move: its row and position are read twice and written once."""
    columns = 1 + 1 + 3 + 3 + 6 + (1 if saturated else 0) + (3 if gimp else 0) + (9 if affine else 0)
    return 3 * 8 * (columns + 3)


def run(peat, case, settings):
    with tempfile.TemporaryDirectory() as directory:
        command = [peat, "run", os.path.join(HERE, "..", "prm", case + ".prm"), "--quiet", "--output", directory]
        for setting in settings:
            command += ["--set", setting]
        subprocess.run(command, check=True)
        with open(os.path.join(directory, "summary.json")) as file:
            return json.load(file)


def median(values):
    return sorted(values)[len(values) // 2]


def seconds_a_step(peat, settings, steps):
    """Of the saturated block: the difference of a long and a short run, without what is done once. And the longer run."""
    few, many = [run(peat, "benchmarks/block_saturated", settings + ["Constants/steps=%g" % n,
                                                                     "Output/Statistics interval=steps*0.5/c"]) for n in steps]
    return ((many["wall_seconds"]["time_loop"] - few["wall_seconds"]["time_loop"]) / (many["steps"] - few["steps"]), many)


def rates(peat, repeat):
    # In a process of its own: what a process used at most is handed down to the programs that it starts.
    with multiprocessing.Pool(1) as pool:
        copy, triad = pool.apply(bandwidth)
    print("memory bandwidth of one core: copy %.1f GB/s, triad %.1f GB/s" % (copy, triad))
    program = run(peat, "benchmarks/block_dry", ["Constants/n=4", "Constants/steps=2"])["peak_memory_bytes"]
    print("memory of the program with 512 points: %.0f MB, nearly all of it pages of shared libraries" % (1e-6 * program))
    print("%-16s %-5s %-6s %-5s %22s %12s %10s %18s %10s" % ("case", "basis", "transf", "order", "million point-steps/s",
                                                             "bytes/point", "of these", "bytes/point-step", "of copy"))
    for case in "block_dry", "block_saturated":
        for basis, update in ("q1", "usl"), ("q1", "musl"), ("gimp", "usl"):
            for transfer in ("aflip", "flip"):
                results = [run(peat, "benchmarks/" + case, ["Explicit MPM/Basis=" + basis, "Explicit MPM/Transfer=" + transfer,
                                                            "Explicit MPM/Stress update=" + update])
                           for _ in range(repeat)]
                found = sorted(r["point_steps_per_second_per_rank"] for r in results)
                moved = least_bytes(case == "block_saturated", basis == "gimp", transfer == "aflip")
                memory, points = results[0]["peak_memory_bytes"], results[0]["points"]
                print("%-16s %-5s %-6s %-5s %22s %12.0f %10.0f %18d %9.0f%%" % (
                    case, basis, transfer, update,
                    "%.1f (%.1f-%.1f)" % (median(found) / 1e6, found[0] / 1e6, found[-1] / 1e6),
                    memory / points, (memory - program) / points, moved, 1e-7 * median(found) * moved / copy))


def semi_implicit(peat, repeat):
    for transfer in "aflip", "flip":
        found = []
        for _ in range(repeat):
            setting = "Explicit MPM/Transfer=" + transfer
            explicit, _ = seconds_a_step(peat, [setting], (10, 40))
            implicit, long_run = seconds_a_step(peat, [setting, "Scheme=semi-implicit"], (100, 500))
            found.append((implicit / explicit, explicit, implicit, long_run["iterations"]))
        ratio, explicit, implicit, work = median(found)
        print("semi-implicit step, %s: %.2f explicit ones (%.2f to %.2f; %.0f and %.0f ms), %.1f iterations a step" % (
            transfer, ratio, min(found)[0], max(found)[0], 1e3 * implicit, 1e3 * explicit,
            work["pressure"] / work["pressure_systems"]))


def column(peat, repeat):
    for basis in "gimp", "q1":
        found = [r["wall_seconds"]["time_loop"] / r["steps"] for r in
                 (run(peat, "verification/P1_terzaghi", ["Scheme=explicit", "Explicit MPM/Basis=" + basis])
                  for _ in range(repeat))]
        print("column of P1, 40 cells, %s: %.1f microseconds a step (%.1f to %.1f)" % (
            basis, 1e6 * median(found), 1e6 * min(found), 1e6 * max(found)))


def background(peat, repeat):
    found = {2: [], 32: []}
    for _ in range(repeat):
        for margin in found:
            found[margin].append(seconds_a_step(peat, [
                "Constants/n=16", "Grid/Lower corner=-%d, -%d, -%d" % (margin, margin, margin),
                "Grid/Upper corner=n+%d, n+%d, n+%d" % (margin, margin, margin),
                "Grid/Cells=n+%d, n+%d, n+%d" % (2 * margin, 2 * margin, 2 * margin)], (100, 1500))[0])
    print("a step in a mesh of 80^3 cells over one in 20^3: %.3f (fastest of each: %.3f)" % (
        median(found[32]) / median(found[2]), min(found[32]) / min(found[2])))


PARTS = {"rates": rates, "semi-implicit": semi_implicit, "column": column, "background": background}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--peat", default=os.path.join(HERE, "..", "build", "peat"))
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--only", choices=PARTS)
    arguments = parser.parse_args()
    for name in [arguments.only] if arguments.only else PARTS:
        PARTS[name](arguments.peat, arguments.repeat)


if __name__ == "__main__":
    main()
