#!/usr/bin/env python3
"""Bad parameter files and bad command lines: each is refused in one clear line, before anything is computed.

    bad_input.py [--peat PROGRAM] [--jobs N] [--verbose] [NAME ...]

Each file bad_input/*.prm but the good ones says in its first lines what is expected:

    # expect: line 7; Young modulus; must be > 0      the place and words of the message, separated by ';'
    # expect: line other.inc:3; ...                   a place in another file
    # options: --set Grid/Cells=4                     more options of the command line

To be refused means: exit code 1, nothing on standard output, one line on standard error that begins with
'peat: ' and holds place and words, no file or directory left behind, and all this within a few seconds.
With NAMEs only the cases whose names contain one of them are run.
"""

import argparse
import os
import queue
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor

HERE = os.path.dirname(os.path.abspath(__file__))
GOOD = ("good.prm", "dry.prm", "solid.prm", "rigid.prm")
SECONDS = 5.0
LONGEST_LINE = 700

# Names, arguments after the program's name, words of the message. '@taken' is a file, '@folder.prm' a directory.
COMMAND_LINES = [
    ("missing file", "run missing.prm", ["cannot read the file 'missing.prm'", "No such file"]),
    ("missing file without command", "missing.prm", ["cannot read the file 'missing.prm'"]),
    ("missing file to check", "check missing.prm", ["cannot read the file 'missing.prm'"]),
    ("directory", "run folder.prm", ["cannot read the file 'folder.prm'", "it is a directory"]),
    ("directory without command", "folder.prm", ["it is a directory"]),
    ("wrong extension", "table.csv", ["'table.csv' is no command and no parameter file (.prm)", "peat --help"]),
    ("wrong extension to run", "run table.csv", ["table.csv:2", "cannot understand"]),
    ("unknown command", "rnu good.prm", ["'rnu' is no command"]),
    ("no file to run", "run", ["'peat run' needs a parameter file"]),
    ("no file to compare", "compare", ["'peat compare' needs a parameter file"]),
    ("comparison of unknown settings", "compare good.prm --set 'Compare/Second=Explicit MPM/Bases=q1'",
     ["Compare/Second", "unknown entry 'Bases'", "did you mean 'Basis'?"]),
    ("comparison of settings out of range", "compare good.prm --set 'Compare/First=Explicit MPM/Step factor=0'",
     ["Compare/First", "Step factor"]),
    ("comparison of settings without value", "compare good.prm --set 'Compare/First=q1'", ["Compare/First", "no '='"]),
    ("comparison of dimensions", "compare good.prm --set 'Compare/Second=Dimension=3'", ["Compare/Second", "'Dimension'"]),
    ("comparison without samples", "compare good.prm --set Compare/Samples=0", ["Compare/Samples", "must be >= 1"]),
    ("no file to sweep", "sweep", ["'peat sweep' needs a parameter file"]),
    ("missing file to sweep", "sweep missing.prm --vary Constants/h=1", ["cannot read the file 'missing.prm'"]),
    ("sweep of nothing", "sweep good.prm", ["nothing to vary", "--vary"]),
    ("sweep without equals sign", "sweep good.prm --vary Constants/h", ["--vary Constants/h", "no '='"]),
    ("sweep without values", "sweep good.prm --vary Constants/h=", ["--vary Constants/h=", "no value to set 'Constants/h' to"]),
    ("sweep without key", "sweep good.prm --vary =1,2", ["--vary =1,2", "names no entry"]),
    ("sweep of a value twice", "sweep good.prm --vary Constants/h=0.25,0.25", ["'0.25' comes twice"]),
    ("sweep of a key twice", "sweep good.prm --vary Method=mpm --vary Method=fem", ["'Method' is varied twice"]),
    ("sweep of a key that is set", "sweep good.prm --set Method=mpm --vary Method=mpm,fem",
     ["--set Method=mpm", "the sweep varies 'Method'"]),
    ("sweep of an unknown constant", "sweep good.prm --vary Constants/hh=0.25,0.125", ["--vary Constants/hh", "no constant 'hh'"]),
    ("sweep of an unknown entry", "sweep good.prm --vary 'Explicit MPM/Bases=q1,gimp'",
     ["--vary Explicit MPM/Bases", "unknown entry 'Bases'", "did you mean 'Basis'?"]),
    ("sweep of an unknown word", "sweep good.prm --vary 'Explicit MPM/Basis=q1,gipm'",
     ["--vary Explicit MPM/Basis", "'gipm' is none of 'q1', 'gimp'"]),
    ("sweep out of range", "sweep good.prm --vary 'Explicit MPM/Step factor=0.5,0'",
     ["--vary Explicit MPM/Step factor", "must be > 0"]),
    ("sweep of a word", "sweep good.prm --vary Constants/h=0.25,small", ["--vary Constants/h", "unknown name 'small'"]),
    ("sweep with unknown references", "sweep good.prm --vary Constants/h=0.25,0.125 --set Sweep/References=presure",
     ["no reference 'presure'", "did you mean 'pressure'?"]),
    ("sweep of what nothing measures", "sweep dry.prm --vary 'Grid/Cells=4, 4; 8, 8'", ["neither 'References' nor 'Probes'"]),
    ("sweep of too many", "sweep good.prm " + " ".join("--vary Constants/%s=%s" % (
        key, ",".join(str(n) for n in range(1, 200))) for key in ("h", "End", "k")), ["combinations", "at most 10000"]),
    ("vary without sweep", "run good.prm --vary Constants/h=1,2", ["'--vary' is for 'peat sweep'"]),
    ("jobs without sweep", "check good.prm --jobs 2", ["'--jobs' is for 'peat sweep'"]),
    ("no jobs", "sweep good.prm --vary Constants/h=0.25,0.125 --jobs 0", ["'--jobs' must be >= 1"]),
    ("negative jobs", "sweep good.prm --vary Constants/h=0.25,0.125 --jobs -2", ["--jobs"]),
    ("target zero", "sweep good.prm --vary Constants/h=0.25,0.125 --target 0", ["'--target' must be a relative error > 0"]),
    ("target of words", "sweep good.prm --vary Constants/h=0.25,0.125 --target low", ["--target", "low"]),
    ("sweep into a file", "sweep good.prm --vary Constants/h=0.25,0.125 --output table.csv",
     ["cannot make the output directory 'table.csv'"]),
    ("no file to check", "check", ["'peat check' needs a parameter file"]),
    ("two files", "run good.prm dry.prm", ["one parameter file at a time", "'dry.prm'"]),
    ("two files without command", "good.prm dry.prm", ["one parameter file at a time", "'dry.prm'"]),
    ("unknown option", "run good.prm --fast", ["'--fast'", "peat --help"]),
    ("unknown short option", "run good.prm -f", ["'-f'", "peat --help"]),
    ("option without value", "run good.prm --output", ["--output", "peat --help"]),
    ("two output directories", "run good.prm --output a --output b", ["--output", "peat --help"]),
    ("empty output directory", "run good.prm --output ''", ["--output"]),
    ("set without equals sign", "run good.prm --set Title", ["--set Title", "no '='"]),
    ("set without name", "run good.prm --set =3", ["--set =3", "no name before '='"]),
    ("set without value", "run good.prm --set Grid/Cells=", ["--set Grid/Cells=", "Grid/Cells"]),
    ("set of unknown entry", "run good.prm --set Grid/Cell=4", ["--set Grid/Cell=4", "did you mean 'Cells'?"]),
    ("set of unknown section", "run good.prm --set Gird/Cells=4,6", ["unknown section 'Gird'", "did you mean 'Grid'?"]),
    ("set of unknown body", "run good.prm --set Bodies/blok/Shape=box(0,0,1,1)",
     ["no section 'blok' in Bodies", "did you mean 'block'?"]),
    ("set of unknown constant", "run good.prm --set Constants/H=1", ["no constant 'H'", "did you mean 'h'?"]),
    ("set out of range", "run good.prm --set 'Materials/sand/Porosity=1.5'",
     ["--set Materials/sand/Porosity=1.5", "must be > 0 and < 1"]),
    ("set of a word", "check good.prm --set Dimension=plane", ["--set Dimension=plane", "unknown name 'plane'"]),
    ("output is a file", "run good.prm --output table.csv", ["cannot make the output directory 'table.csv'"]),
    ("output below a file", "run good.prm --output table.csv/out", ["cannot make the output directory 'table.csv/out'"]),
    ("unknown format", "parameters --format yaml", ["'--format yaml' is unknown", "prm, markdown or json"]),
    ("parameters of a file", "parameters good.prm", ["'peat parameters' takes no file"]),
    ("parameters in 4-D", "parameters --dimension 4", ["'--dimension' must be 2 or 3"]),
    ("parameters in no dimension", "parameters --dimension two", ["two", "--dimension", "peat --help"]),
]

# What nobody should have to read.
OURS = re.compile(r"deal\.?II|terminate called|internal error|std::|Assert|MPI_ABORT|backtrace|[Ss]egmentation|\bnan\b")


def cases_of_files():
    """Name, arguments, line, words of each bad file."""
    for name in sorted(os.listdir(os.path.join(HERE, "bad_input"))):
        if not name.endswith(".prm") or name in GOOD:
            continue
        with open(os.path.join(HERE, "bad_input", name), "rb") as file:
            text = file.read().decode("utf-8", "replace")
        expect = re.search(r"^# expect: (.*)$", text, re.M)
        if not expect:
            sys.exit(f"{name} does not say what is expected")
        words = [word.strip() for word in expect.group(1).split("; ")]
        options = re.search(r"^# options: (.*)$", text, re.M)
        for i, word in enumerate(words):
            place = re.fullmatch(r"line (?:(\S+):)?(\d+)", word)
            if place:
                words[i] = f"peat: {place.group(1) or name}:{place.group(2)}: "
        arguments = [name] + (shlex.split(options.group(1)) if options else [])
        yield name[:-4], arguments, words


def listing(directory):
    return sorted(os.path.join(path, name) for path, folders, files in os.walk(directory) for name in folders + files)


class Workplace:
    """A directory with all files, used by one program at a time."""

    def __init__(self):
        self.scratch = tempfile.mkdtemp(prefix="peat_bad_input_")
        self.directory = os.path.join(self.scratch, "case")
        # With this Open MPI starts no daemon for each program, but puts what it needs into TMPDIR.
        self.environment = dict(os.environ, OMPI_MCA_ess_singleton_isolated="1", TMPDIR=self.scratch)
        self.tidy()

    def tidy(self):
        shutil.rmtree(self.directory, ignore_errors=True)
        shutil.copytree(os.path.join(HERE, "bad_input"), self.directory)
        os.mkdir(os.path.join(self.directory, "folder.prm"))
        self.before = listing(self.directory)

    def run(self, command, seconds):
        """Exit code (None if it takes too long), standard output, standard error."""
        try:
            run = subprocess.run(command, cwd=self.directory, env=self.environment, capture_output=True, timeout=seconds)
        except subprocess.TimeoutExpired:
            return None, "", ""
        return run.returncode, run.stdout.decode("utf-8", "replace"), run.stderr.decode("utf-8", "replace")

    def left_behind(self):
        """What is new; it is removed."""
        left = [path[len(self.directory) + 1:] for path in listing(self.directory) if path not in self.before]
        if left:
            self.tidy()
        return left

    def remove(self):
        shutil.rmtree(self.scratch, ignore_errors=True)


def problems(workplace, command, words):
    """What is wrong with the answer to a command, and what it said."""
    code, out, err = workplace.run(command, SECONDS)
    if code is None:
        workplace.tidy()
        return [f"takes more than {SECONDS} s"], ""
    found = []
    if code != 1:
        found.append(f"signal {-code}" if code < 0 else f"exit code {code}, not 1")
    if out:
        found.append("something on standard output: " + out.splitlines()[0])
    if not err.startswith("peat: ") or not err.endswith("\n") or len(err.splitlines()) != 1:
        found.append("not one line 'peat: ...' on standard error")
    if len(err) > LONGEST_LINE:
        found.append(f"a message of {len(err)} characters")
    if OURS.search(out + err):
        found.append("our words: " + OURS.search(out + err).group(0))
    found += [f"does not say {word!r}" for word in words if word not in err]
    left = workplace.left_behind()
    if left:
        found.append("leaves behind: " + ", ".join(left[:5]))
    return found, err


def good_files_pass(workplace, peat):
    """The good files are good, or the bad ones would prove nothing; so are the complete parameters of a run."""
    passed = True
    for name in GOOD:
        written = os.path.join(workplace.directory, "output", name[:-4], "parameters.prm")
        for command in (["check", name], ["run", name, "--quiet"], ["check", "again.prm"]):
            if os.path.exists(written):
                shutil.copy(written, os.path.join(workplace.directory, "again.prm"))
            code, _, err = workplace.run([peat] + command, 60)
            if code != 0 or err:
                passed = False
                print(f"FAILED  peat {' '.join(command)} ({name}): exit code {code}\n        {err.strip()}")
        workplace.tidy()
    return passed


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--peat", default=os.path.join(HERE, "..", "build", "peat"), help="the program")
    parser.add_argument("--jobs", type=int, default=2, help="programs at a time")
    parser.add_argument("--share", type=int, default=1, metavar="N", help="one case of N")
    parser.add_argument("--verbose", action="store_true", help="show all messages")
    parser.add_argument("names", nargs="*", help="only cases whose names contain one of these")
    options = parser.parse_args()
    peat = os.path.abspath(options.peat)
    if not os.access(peat, os.X_OK):
        sys.exit(f"there is no program '{peat}'; use --peat")

    cases = []
    for i, (name, arguments, words) in enumerate(cases_of_files()):
        cases.append((name, ["run"] + arguments, words))
        if i % 6 == 0:
            cases.append((name + " (check)", ["check"] + arguments, words))
    for name, arguments, words in COMMAND_LINES:
        cases.append((name, shlex.split(arguments), words))
    if options.names:
        cases = [case for case in cases if any(name in case[0] for name in options.names)]

    cases = cases[::options.share]

    workplaces = queue.Queue()
    for _ in range(options.jobs):
        workplaces.put(Workplace())

    def look_at(case):
        workplace = workplaces.get()
        try:
            return problems(workplace, [peat] + case[1], case[2])
        finally:
            workplaces.put(workplace)

    n_failed = 0
    with ThreadPoolExecutor(options.jobs) as pool:
        for (name, arguments, _), (found, message) in zip(cases, pool.map(look_at, cases)):
            n_failed += bool(found)
            if found or options.verbose:
                print(f"{'FAILED' if found else 'ok    '}  {name}: peat {' '.join(arguments)}\n"
                      f"        {message.strip() or '(says nothing)'}")
                for problem in found:
                    print("      - " + problem)
    passed = bool(options.names) or good_files_pass(workplaces.queue[0], peat)
    while not workplaces.empty():
        workplaces.get().remove()
    print(f"{len(cases)} cases, {n_failed} failed")
    return 0 if passed and n_failed == 0 else 1


if __name__ == "__main__":
    sys.exit(main())
