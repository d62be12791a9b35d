#!/usr/bin/env python3
"""What contact costs: tests/contact_benchmark.py [--peat build/peat] [--repeat 5].

Time of a step of prm/examples/falling_block.prm (without its static stage) on one core: with its contact while the bodies
touch, and while they are apart, each against the same bodies of which the file names no contact, so that they share one
velocity. The runs alternate; ratios are of the medians of both. Exit code 1 if contact costs more than 25 %, or more than 2 %
while nothing touches.
"""
import argparse
import json
import os
import re
import subprocess
import sys
import tempfile

from scene_tools import without

HERE = os.path.dirname(os.path.abspath(__file__))
LIMITS = {"touching": 0.25, "apart": 0.02}


def seconds_a_step(peat, case, settings):
    with tempfile.TemporaryDirectory() as directory:
        command = [peat, "run", case, "--quiet", "--output", directory]
        for setting in settings:
            command += ["--set", setting]
        subprocess.run(command, check=True)
        with open(os.path.join(directory, "summary.json")) as file:
            summary = json.load(file)
        return summary["wall_seconds"]["time_loop"] / summary["steps"]


def median(values):
    values = sorted(values)
    return values[len(values) // 2]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--peat", default=os.path.join(HERE, "..", "build", "peat"))
    parser.add_argument("--repeat", type=int, default=5)
    arguments = parser.parse_args()

    with open(os.path.join(HERE, "..", "prm", "examples", "falling_block.prm")) as file:
        text = without(file.read(), "rest")
    text = text.replace("set Height = 5 ", "set Height = 5\n  set End = 0.02")
    text = re.sub(r"set Duration *= .*", "set Duration = End", text)
    common = ["Output/Pictures=false", "Output/Statistics interval=0.01", "Output/Probe interval=0.01"]
    cases = {"touching": ["Constants/Gap=0.001", "Constants/End=0.02"], "apart": ["Constants/Gap=0.6", "Constants/End=0.02"]}
    failed = False
    with tempfile.TemporaryDirectory() as directory:
        names = {"contact": text, "none": without(text, "Contacts")}
        for name, content in names.items():
            with open(os.path.join(directory, name + ".prm"), "w") as file:
                file.write(content)
        for case, settings in cases.items():
            times = {name: [] for name in names}
            for _ in range(arguments.repeat):
                for name in names:
                    times[name].append(seconds_a_step(arguments.peat, os.path.join(directory, name + ".prm"),
                                                      common + settings))
            found = {name: median(values) for name, values in times.items()}
            cost = found["contact"] / found["none"] - 1.
            spread = max(max(v) / min(v) - 1. for v in times.values())
            good = cost <= LIMITS[case]
            failed = failed or not good
            print("%-6s %-9s %.1f us a step with contact, %.1f us without: %+.1f %% (limit %.0f %%; single runs differ by up "
                  "to %.0f %%)" % ("ok" if good else "FAILED", case, 1e6 * found["contact"], 1e6 * found["none"],
                                   100. * cost, 100. * LIMITS[case], 100. * spread), flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
