#!/usr/bin/env python3
"""A run that is stopped and resumed must leave what one leaves that was never stopped, in every digit.

    restart.py --peat build/peat --case NAME [--keep DIR]
    restart.py --list quick|full

Runs are stopped in two ways: by SIGTERM, on which they write a checkpoint, and by SIGKILL, after which the last
checkpoint counts and what was written since is cut off. Where a signal comes is left to chance.
"""
import json
import os
import shutil
import signal
import subprocess
import sys
import time

import scene_tools

ENVIRONMENT = dict(os.environ, OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1",
                   OMPI_MCA_rmaps_base_oversubscribe="1", OMP_NUM_THREADS="1")
OFTEN = {"Output/Checkpoint interval": "0.1/60"}   # [min]
MEASURED = ("wall_seconds", "point_steps_per_second_per_rank", "peak_memory_bytes")


def command(c, scene, settings, directory, ranks=1, more=()):
    words = [c.peat, "run", os.path.join(scene_tools.SCENES, scene + ".prm"), "--quiet", "--output", directory]
    for key, value in settings.items():
        words += ["--set", "%s=%s" % (key, value)]
    return (["mpirun", "-np", str(ranks)] if ranks > 1 else []) + words + list(more)


def execute(words):
    done = subprocess.run(words, env=ENVIRONMENT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, timeout=1200,
                          universal_newlines=True)
    return done.returncode, done.stderr.strip()


def a_rank_of(words, process):
    """The id of a rank that mpirun has started: the others are to learn of a signal, and mpirun would end them all."""
    if words[0] != "mpirun":
        return process
    return int(open("/proc/%d/task/%d/children" % (process, process)).read().split()[0])


def size_of(path):
    return os.path.getsize(path) if os.path.exists(path) else 0


def has_checkpoint(directory):
    return os.path.exists(os.path.join(directory, "checkpoint", "index.json"))


def stop(words, directory, how, after):
    """Sends a signal when so many bytes of statistics are there (and, for SIGKILL, a checkpoint); returns the code."""
    for _ in range(5):   # a run may be over before the signal comes
        code = try_to_stop(words, directory, how, after)
        if code != 0:
            break
        after *= 0.5
    return code


def try_to_stop(words, directory, how, after):
    statistics = os.path.join(directory, "statistics.csv")
    shutil.rmtree(directory, ignore_errors=True)
    process = subprocess.Popen(words, env=ENVIRONMENT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    while process.poll() is None:
        if size_of(statistics) > after and (
                how == signal.SIGTERM or has_checkpoint(directory)):
            os.kill(a_rank_of(words, process.pid), how)
            break
        time.sleep(0.001)
    return process.wait(timeout=1200)


def read(directory, name):
    with open(os.path.join(directory, name), "rb") as file:
        return file.read()


def differences(a, b):
    """Names of the files in which two directories of runs differ, measured times apart."""
    def summary(directory):
        values = json.loads(read(directory, "summary.json"))
        return {key: value for key, value in values.items() if key not in MEASURED}

    def picture(directory, name):
        lines = read(directory, "pictures/" + name).splitlines()
        return [line for line in lines if not line.startswith(b"#This file was generated")]

    def log(directory):
        lines = read(directory, "log.txt").decode().splitlines()
        return [line for line in lines if not line.startswith(("resumed at", "results are in"))]

    found = []
    for name in ("statistics.csv", "probes.csv", "errors.csv", "solution.pvd"):
        present = [os.path.exists(os.path.join(d, name)) for d in (a, b)]
        if present[0] != present[1] or (present[0] and read(a, name) != read(b, name)):
            found.append(name)
    if summary(a) != summary(b):
        found.append("summary.json")
    if log(a) != log(b):
        found.append("log.txt")
    pictures = os.path.join(a, "pictures")
    for name in sorted(os.listdir(pictures)) if os.path.exists(pictures) else []:
        if picture(a, name) != picture(b, name):
            found.append(name)
    return found


def check(c, scene, settings=None, ranks=1, ways=(signal.SIGTERM, signal.SIGKILL), share=0.3):
    """Stops at about this share of the run."""
    settings = dict(settings or {})
    what = "%s %s" % (os.path.basename(scene), "" if ranks == 1 else "on %d ranks" % ranks)
    c.n_runs += 1
    whole = os.path.join(c.root, "%03d_whole" % c.n_runs)
    code, message = execute(command(c, scene, settings, whole, ranks))
    c.note(what + ": uninterrupted", code == 0, message)
    if code != 0:
        raise scene_tools.Stop()
    size = size_of(os.path.join(whole, "statistics.csv"))
    for way in ways:
        c.n_runs += 1
        directory = os.path.join(c.root, "%03d_resumed" % c.n_runs)
        often = OFTEN if way == signal.SIGKILL else {}
        words = command(c, scene, dict(settings, **often), directory, ranks)
        code = stop(words, directory, way, share * size)
        c.note(what + ": stopped by " + way.name, code != 0 and has_checkpoint(directory), "exit code %d" % code)
        if not has_checkpoint(directory):
            raise scene_tools.Stop()
        index = json.loads(read(directory, "checkpoint/index.json"))
        code, message = execute(words + ["--resume"])
        found = differences(whole, directory) if code == 0 else ["exit code %d: %s" % (code, message)]
        c.note("    resumed at step %d, stage %d" % (index["step"], index["stage"]), not found,
               "differs: " + ", ".join(found) if found else "equal")
    return whole


EXPLICIT = {"Scheme": "explicit"}
SEMI = {"Scheme": "semi-implicit"}
IMPLICIT = {"Scheme": "implicit"}
FEM = {"Method": "fem"}


def explicit(c):
    check(c, "I2_rigid_on_column", dict(EXPLICIT, **{"Constants/cells": 320}))


def explicit_more(c):
    check(c, "C3_rigid_roller", {"Output/Pictures": "true"})
    check(c, "I3_saturated_discs")
    check(c, "C3_tilted", {"Constants/End": 0.05})
    check(c, "I2_3d", {"Constants/cells": 80})


def semi_implicit(c):
    check(c, "D3_ramp", dict(SEMI, **{"Constants/cells": 320}))


def semi_implicit_more(c):
    check(c, "I2_rigid_on_column", dict(SEMI, **{"Constants/cells": 320}))
    check(c, "D3_ramp_3d", dict(SEMI, **{"Constants/cells": 40}))


def implicit(c):
    check(c, "P1_terzaghi", IMPLICIT)
    check(c, "P1_rigid_plate", {"Constants/cells": 80})
    check(c, "C8_indentation", {"Constants/cells": 80})


ITERATIVE = {"Linear solver/Method": "iterative"}


def implicit_more(c):
    check(c, "L1_finite_strain_consolidation")
    check(c, "C3_rigid_block")
    check(c, "C8_3d")
    check(c, "P1_terzaghi", dict(IMPLICIT, **ITERATIVE))


def elements(c):
    check(c, "D3_ramp", FEM)
    check(c, "D3_ramp", dict(FEM, **dict(ITERATIVE, **{"Constants/cells": 10})))


def stages(c):
    check(c, "G1_stages", {"Constants/cells": 40})


EXAMPLES = "../examples/"


def stages_more(c):
    for share in 0.2, 0.6, 0.95:
        check(c, EXAMPLES + "tamper_consolidation", share=share)
    check(c, EXAMPLES + "falling_block")


def ranks(c):
    check(c, "D3_ramp", dict(SEMI, **{"Constants/cells": 320}), 2)
    check(c, "I3_saturated_discs", {}, 2)


def checksum(text):
    """That of checkpoint.cc."""
    state, data = 0xcbf29ce484222325, text.encode()
    for k in range(0, len(data), 8):
        state = ((state ^ int.from_bytes(data[k:k + 8].ljust(8, b"\0"), "little")) * 0x100000001b3) % 2**64
    return "%016x" % state


def change_index(directory, **changes):
    """Changes entries of index.json and its checksum with them."""
    path = os.path.join(directory, "checkpoint", "index.json")
    index = json.load(open(path))
    found = index.pop("checksum")

    def sealed():
        return checksum(json.dumps(index, separators=(",", ":"), ensure_ascii=False))

    right = found == sealed()
    index.update(changes)
    index["checksum"] = sealed()
    json.dump(index, open(path, "w"))
    return right


def change_file(path, change):
    data = bytearray(open(path, "rb").read())
    open(path, "wb").write(change(data))


def flip(data):
    data[len(data) // 2] ^= 1
    return data


def refused(c):
    """What cannot be resumed is refused in one line, and the directory stays as it is."""
    scene, settings = "I2_rigid_on_column", dict(EXPLICIT, **{"Constants/cells": 160})
    origin = os.path.join(c.root, "stopped")
    words = command(c, scene, settings, origin)
    stop(words, origin, signal.SIGTERM, 1000)
    if not has_checkpoint(origin):
        c.note("a run to resume", False, "no checkpoint")
        raise scene_tools.Stop()
    directory = os.path.join(c.root, "tried")
    state = [name for name in os.listdir(os.path.join(origin, "checkpoint")) if name.startswith("step-")][0]

    def attempt(what, expected, more=None, prepare=lambda: None, ranks=1):
        """`expected`: words of the message, or None if it goes on."""
        shutil.rmtree(directory, ignore_errors=True)
        shutil.copytree(origin, directory)
        prepare()
        before = read(directory, "statistics.csv")
        code, message = execute(command(c, scene, dict(settings, **(more or {})), directory, ranks, ["--resume"]))
        lines = [line for line in message.splitlines() if line.startswith("peat:")]
        if expected is None:
            c.note(what, code == 0, "exit code %d %s" % (code, message))
            return
        good = code == 1 and len(lines) == 1 and expected in lines[0] and read(directory, "statistics.csv") == before
        c.note(what, good, "exit code %d %s" % (code, message))

    def in_checkpoint(name, change):
        return lambda: change_file(os.path.join(directory, "checkpoint", name), change)

    attempt("nothing changed", None)
    attempt("no checkpoint", "holds no checkpoint", prepare=lambda: shutil.rmtree(directory + "/checkpoint"))
    attempt("a flipped bit", "'%s' is not what was written" % state, prepare=in_checkpoint(state, flip))
    attempt("a truncated file", "'%s' is not what was written" % state, prepare=in_checkpoint(state, lambda d: d[:-8]))
    attempt("a missing file", "'%s' is not what was written" % state,
            prepare=lambda: os.remove(os.path.join(directory, "checkpoint", state)))
    attempt("a flipped bit of the index", "'index.json' is not what was written",
            prepare=in_checkpoint("index.json", flip))
    attempt("another version", "written by version 0.0.1", prepare=lambda: c.note(
        "    the index can be changed", change_index(directory, version="0.0.1"), ""))
    attempt("two ranks", "1 rank(s)", ranks=2)
    attempt("a shorter table", "statistics.csv' is shorter",
            prepare=lambda: os.truncate(os.path.join(directory, "statistics.csv"), 1000))
    attempt("another parameter", "Materials/soil/linear elastic/Poisson ratio: is '0.2', but '0.3'",
            {"Materials/soil/linear elastic/Poisson ratio": 0.2})
    attempt("another constant", "Materials/soil/Hydraulic conductivity: is '0.001'", {"Constants/k": 1e-3})
    attempt("an end that has passed", "Stages/impact/Duration: ends before", {"Constants/After": 1e-7})
    attempt("a longer stage, other intervals", None,
            {"Constants/After": 0.03, "Output/Statistics interval": 1e-3, "Output/Checkpoint interval": 1})
    c.note("    goes to the new end", scene_tools.Run(directory, 0, "").summary["simulated_time"] == 0.03, "")
    times = scene_tools.Run(directory, 0, "").table("statistics.csv")["time"]
    c.note("    its lines follow each other", all(a < b for a, b in zip(times, times[1:])), "%d lines" % len(times))

    def leave_rest():
        for name in "step-0-rank-0", "index.json.tmp":
            open(os.path.join(directory, "checkpoint", name), "w").write("half")

    attempt("what a crash leaves while a checkpoint is written", None, prepare=leave_rest)
    code, message = execute([c.peat, "check", os.path.join(scene_tools.SCENES, scene + ".prm"), "--resume"])
    c.note("'peat check --resume'", code == 1 and "'--resume' is for 'peat run'" in message, message)
    shutil.rmtree(directory)
    shutil.copytree(origin, directory)
    code, _ = execute(command(c, scene, settings, directory))
    c.note("a new run forgets the checkpoint", code == 0 and not has_checkpoint(directory), "")


# Those without a label are more scenes for what others have: run with --case.
CASES = {
    "restart_explicit": (explicit, ("quick", "full"), 5),
    "restart_refused": (refused, ("quick", "full"), 10),
    "restart_explicit_more": (explicit_more, (), 60),
    "restart_semi_implicit": (semi_implicit, ("quick", "full"), 5),
    "restart_semi_implicit_more": (semi_implicit_more, (), 60),
    "restart_implicit": (implicit, ("full",), 30),
    "restart_implicit_more": (implicit_more, ("full",), 30),
    "restart_elements": (elements, ("full",), 30),
    "restart_stages": (stages, ("full",), 30),
    "restart_stages_more": (stages_more, (), 60),
    "restart_ranks": (ranks, ("full",), 60),
}

if __name__ == "__main__":
    sys.exit(scene_tools.main(CASES, __doc__))
