#!/usr/bin/env python3
"""Is the scheme that `Scheme = auto` takes the fastest? tests/schemes.py [--peat build/peat] [--seconds 10] [--case NAME...]

For each scene of prm/verification and prm/examples with a dynamic stage, reads from `peat check` what each scheme would need
(steps, their length), runs each with steps of that length, for so many seconds or a few times more, and prints the time of the
whole stage (steps times the measured time of a step), and how many times longer than the fastest scheme the chosen one takes.
"""
import argparse
import glob
import os
import re
import signal
import subprocess
import sys
import tempfile
import time

from scene_tools import Run

HERE = os.path.dirname(os.path.abspath(__file__))
SCHEMES = ("explicit", "semi-implicit", "implicit")
QUIET = ["Output/Pictures=false"]


def command(peat, what, path, settings):
    return [peat, what, path] + [part for setting in settings for part in ("--set", setting)]


def estimates(peat, path):
    """The first dynamic stage: {scheme: (steps, length of a step, is it chosen, what limits it)}."""
    done = subprocess.run(command(peat, "check", path, ["Scheme=auto"]), stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                          universal_newlines=True)
    found = {}
    for line in done.stdout.splitlines():
        match = re.match(r"  ([* ]) ([a-z-]+): about (\S+) steps of (\S+) s \((.*)\), cost", line)
        if match and match.group(2) not in found:
            found[match.group(2)] = (float(match.group(3)), float(match.group(4)), match.group(1) == "*", match.group(5))
        elif found and line.startswith("stage "):
            break
    return found


def run(peat, path, settings, seconds):
    """What summary.json says of a run that is ended after so many seconds, and what the run said."""
    with tempfile.TemporaryDirectory() as directory:
        process = subprocess.Popen(command(peat, "run", path, settings) + ["--quiet", "--output", directory],
                                   stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, universal_newlines=True)
        end = time.time() + seconds
        while process.poll() is None and time.time() < end:
            time.sleep(0.02)
        if process.poll() is None:
            process.send_signal(signal.SIGINT)
        message = process.communicate()[1]
        return Run(directory, process.returncode, message).summary, message.strip()


def measure(peat, path, scheme, length, limit, seconds):
    """Seconds a step, the number of steps if the run came to its end, and what it said if it failed."""
    settings = QUIET + ["Scheme=" + scheme]
    if scheme == "implicit" and limit == "waves":
        settings.append("Implicit solver/Time step=%g" % length)
    elif scheme != "implicit":
        settings.append("Explicit MPM/Time step=%g" % length)
    summary, message = run(peat, path, settings, seconds)
    if not summary.get("steps"):
        return None, None, message
    spent, steps = summary["wall_seconds"]["time_loop"], summary["steps"]
    if summary["completed"]:
        return spent / steps, steps, message
    # What a static stage takes before the steps that count falls out of the difference.
    for factor in (2, 4, 8):
        longer = run(peat, path, settings, factor * seconds)[0]
        if longer["steps"] > steps + 5:
            return (longer["wall_seconds"]["time_loop"] - spent) / (longer["steps"] - steps), None, message
    return (longer["wall_seconds"]["time_loop"]) / longer["steps"], None, message


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--peat", default=os.path.join(HERE, "..", "build", "peat"))
    parser.add_argument("--seconds", type=float, default=10.)
    parser.add_argument("--case", nargs="*")
    arguments = parser.parse_args()
    worst = 0.
    print("| scene | chosen | explicit [s] | semi-implicit [s] | implicit [s] | chosen over fastest |\n|---|---|---|---|---|---|")
    for path in sorted(glob.glob(os.path.join(HERE, "..", "prm", "verification", "*.prm")) +
                       glob.glob(os.path.join(HERE, "..", "prm", "examples", "*.prm"))):
        name = os.path.splitext(os.path.basename(path))[0]
        if arguments.case and name not in arguments.case:
            continue
        asked = estimates(arguments.peat, path)
        if len(asked) < 2:
            continue
        total, texts = {}, {}
        for scheme, (steps, length, _, limit) in asked.items():
            seconds_a_step, taken, message = measure(arguments.peat, path, scheme, length, limit, arguments.seconds)
            if seconds_a_step is None:
                texts[scheme] = "fails"
                print("%s, %s: %s" % (name, scheme, message), file=sys.stderr)
                continue
            count = taken or steps
            total[scheme] = count * seconds_a_step
            texts[scheme] = "%.2g (%d x %.2g ms)" % (total[scheme], count, 1e3 * seconds_a_step)
        chosen = next(scheme for scheme in asked if asked[scheme][2])
        ratio = total[chosen] / min(total.values()) if chosen in total else float("nan")
        worst = max(worst, ratio)
        print("| %s | %s | %s | %.2f |" % (name, chosen, " | ".join(texts.get(s, "") for s in SCHEMES), ratio), flush=True)
    print("largest: %.2f" % worst)


if __name__ == "__main__":
    main()
