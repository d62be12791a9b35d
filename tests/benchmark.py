#!/usr/bin/python3
"""Throughput of the explicit step, beside the machine's memory bandwidth: tests/benchmark.py [--peat build/peat].

Runs prm/benchmarks/block_dry.prm and block_saturated.prm (512,000 points in 3-D, 8 points a cell) on one core for each
basis and transfer, and prints million point-steps a second, bytes of memory a point (whole process), bytes a point-step
that the algorithm has to move at least, and the share of the copy bandwidth that this makes.
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
        command = [peat, "run", os.path.join(HERE, "..", "prm", "benchmarks", case + ".prm"), "--quiet", "--output",
                   directory]
        for setting in settings:
            command += ["--set", setting]
        subprocess.run(command, check=True)
        with open(os.path.join(directory, "summary.json")) as file:
            return json.load(file)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--peat", default=os.path.join(HERE, "..", "build", "peat"))
    parser.add_argument("--repeat", type=int, default=3)
    arguments = parser.parse_args()
    # In a process of its own: what a process used at most is handed down to the programs that it starts.
    with multiprocessing.Pool(1) as pool:
        copy, triad = pool.apply(bandwidth)
    print("memory bandwidth of one core: copy %.1f GB/s, triad %.1f GB/s" % (copy, triad))
    print("%-16s %-5s %-6s %-5s %22s %12s %18s %10s" % ("case", "basis", "transf", "order", "million point-steps/s",
                                                        "bytes/point", "bytes/point-step", "of copy"))
    for case in "block_dry", "block_saturated":
        for basis, update in ("q1", "usl"), ("q1", "musl"), ("gimp", "usl"):
            for transfer in ("aflip", "flip"):
                results = [run(arguments.peat, case, ["Explicit MPM/Basis=" + basis, "Explicit MPM/Transfer=" + transfer,
                                                      "Explicit MPM/Stress update=" + update])
                           for _ in range(arguments.repeat)]
                rates = sorted(r["point_steps_per_second_per_rank"] for r in results)
                rate = rates[len(rates) // 2]
                moved = least_bytes(case == "block_saturated", basis == "gimp", transfer == "aflip")
                print("%-16s %-5s %-6s %-5s %22s %12.0f %18d %9.0f%%" % (
                    case, basis, transfer, update, "%.1f (%.1f-%.1f)" % (rate / 1e6, rates[0] / 1e6, rates[-1] / 1e6),
                    results[0]["peak_memory_bytes"] / results[0]["points"], moved, 1e-7 * rate * moved / copy))


if __name__ == "__main__":
    main()
