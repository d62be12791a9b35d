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
OFTEN = {"Output/Checkpoint interval": "0.1/60"}      # [min]
ALWAYS = {"Output/Checkpoint interval": "1e-9"}       # after every step
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


def check(c, scene, settings=None, ranks=1, ways=(signal.SIGTERM, signal.SIGKILL), share=0.3, same_checkpoints=False):
    """Stops at about this share of the run. same_checkpoints: the uninterrupted run writes checkpoints, too."""
    settings = dict(settings or {})
    what = "%s %s" % (os.path.basename(scene), "" if ranks == 1 else "on %d ranks" % ranks)
    c.n_runs += 1
    whole = os.path.join(c.root, "%03d_whole" % c.n_runs)
    code, message = execute(command(c, scene, dict(settings, **(ALWAYS if same_checkpoints else {})), whole, ranks))
    c.note(what + ": uninterrupted", code == 0, message)
    if code != 0:
        raise scene_tools.Stop()
    size = size_of(os.path.join(whole, "statistics.csv"))
    for way in ways:
        c.n_runs += 1
        directory = os.path.join(c.root, "%03d_resumed" % c.n_runs)
        often = ALWAYS if same_checkpoints else OFTEN if way == signal.SIGKILL else {}
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
    # Multigrid is set up anew after a checkpoint: equal to a run that wrote one after each step, too.
    check(c, "P1_terzaghi", dict(IMPLICIT, **ITERATIVE), same_checkpoints=True)


def elements(c):
    check(c, "D3_ramp", FEM)
    check(c, "L1_finite_strain_consolidation", FEM)
    check(c, "D3_ramp", dict(FEM, **dict(ITERATIVE, **{"Constants/End": 0.1})), same_checkpoints=True)


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


CASES = {
    "restart_explicit": (explicit, ("quick", "full"), 5),
    "restart_explicit_more": (explicit_more, ("full",), 60),
    "restart_semi_implicit": (semi_implicit, ("quick", "full"), 5),
    "restart_semi_implicit_more": (semi_implicit_more, ("full",), 60),
    "restart_implicit": (implicit, ("full",), 30),
    "restart_implicit_more": (implicit_more, ("full",), 30),
    "restart_elements": (elements, ("full",), 30),
    "restart_stages": (stages, ("full",), 30),
    "restart_stages_more": (stages_more, ("full",), 60),
    "restart_ranks": (ranks, ("full",), 60),
}

if __name__ == "__main__":
    sys.exit(scene_tools.main(CASES, __doc__))
