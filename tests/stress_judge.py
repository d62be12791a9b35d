"""Whether a run of tests/stress.py is sound: what is looked at, and the bounds."""
import math
import os
import re

from scene_tools import read_table, read_vtu

MOST_ENERGY = 5e-3      # above the work, over the largest energy
MOST_IMBALANCE = 1e-10  # of momentum and of fluid mass
MOST_CHECKERBOARD = 1e-2  # of the pressures of cells, over the largest
# What the program says of a step that was too large.
NAMES_THE_STEP = re.compile(r"[Ss]tep|unstable|stable")


class Verdict:
    def __init__(self, state, reason="", **numbers):
        self.state, self.reason, self.numbers = state, reason, numbers

    @property
    def is_good(self):
        return self.state in ("sound", "refused", "caught")


def judge(case, run):
    if run.code is None:
        return Verdict("FAILED", "takes more than the time it is given")
    if run.code == 1:
        lines = run.message.splitlines()
        clear = len(lines) == 1 and lines[0].startswith("peat: ") and not run.summary
        return Verdict("refused" if clear else "FAILED", lines[0][6:] if clear else "unclear refusal: " + run.message[:200])
    if run.code not in (0, 2):
        return Verdict("FAILED", "crash: exit code %d: %s" % (run.code, run.message[-200:]))
    if run.code == 2:
        reason = run.message.replace("peat: ", "", 1)
        if not case.too_large:
            return Verdict("FAILED", reason)
        return Verdict("caught", reason) if NAMES_THE_STEP.search(reason) else Verdict(
            "FAILED", "caught, but the step is not named: " + reason)
    verdict = judge_completed(run)
    if case.too_large:
        return Verdict("FAILED", "a step above the limit is not caught (%s)" % (verdict.reason or "the run ends sound"),
                       **verdict.numbers)
    return verdict


def judge_completed(run):
    table = run.table("statistics.csv")
    # Reports beside a contact that is open hold no gap.
    values = [v for name, column in table.items() if not name.endswith("/gap") for v in column]
    if not all(math.isfinite(v) for v in values) or not run.summary.get("completed"):
        return Verdict("FAILED", "numbers that are not finite")
    gain, gain_at_end = energy_gain(table)
    numbers = {"energy": gain, "energy at the end": gain_at_end, "momentum": run.summary["balance"]["momentum"],
               "fluid mass": run.summary["balance"]["fluid_mass"], "checkerboard": checkerboard(run)}
    bounds = {"energy": MOST_ENERGY, "momentum": MOST_IMBALANCE, "fluid mass": MOST_IMBALANCE, "checkerboard": MOST_CHECKERBOARD}
    wrong = ["%s %.2g" % (name, numbers[name]) for name in bounds if not numbers[name] <= bounds[name]]
    if gain > MOST_ENERGY >= gain_at_end:
        wrong[0] += " (swings; %.1g in the mean of the last quarter)" % gain_at_end
    if run.summary["lost_points"] != 0:
        wrong.append("lost points")
    return Verdict("FAILED" if wrong else "sound", ", ".join(wrong), **numbers)


def energy_gain(table):
    """Largest excess of the energy over what has gone in, relative to the largest energy, work or dissipation of the run; and
    the mean of it over the last quarter, which tells energy that comes and goes from energy that grows."""
    energy = [sum(parts) for parts in zip(table["kinetic energy"], table["elastic energy"], table["fluid energy"])]
    scale = max(energy + [abs(w) for w in table["external work"]] + table["seepage dissipation"])
    if not scale > 0.0:
        return 0.0, 0.0
    missing = table["numerical dissipation"]
    last = missing[-(len(missing) // 4):]
    return max(0.0, -min(missing)) / scale, max(0.0, -sum(last) / len(last)) / scale


def checkerboard(run):
    """Largest amplitude of pressures of cells that alternate from cell to cell, in either direction or in both, relative
    to the largest pressure of all pictures."""
    folder = os.path.join(run.directory, "pictures")
    lower, size = mesh(run)
    fields = [cell_means(read_vtu(os.path.join(folder, name)), lower, size)
              for name in sorted(os.listdir(folder)) if re.match(r"ground-\d+\.vtu$", name)]
    largest = max((abs(p) for field in fields for p in field.values()), default=0.0)
    return max(map(alternation, fields)) / largest if largest > 0.0 else 0.0


def mesh(run):
    with open(os.path.join(run.directory, "parameters.prm")) as file:
        text = file.read()
    numbers = lambda key: [float(x) for x in re.search(r"^ *set %s = (.*)$" % key, text, re.M).group(1).split(",")]
    lower, upper, cells = numbers("Lower corner"), numbers("Upper corner"), numbers("Cells")
    return lower, [(u - l) / n for l, u, n in zip(lower, upper, cells)]


def cell_means(points, lower, size):
    """Means of the pressure over points, by cell."""
    sums = {}
    for x, p, volume in zip(points["position"], points["pressure"], points["volume"]):
        cell = tuple(math.floor((x[d] - lower[d]) / size[d]) for d in range(2))
        total = sums.setdefault(cell, [0.0, 0.0])
        total[0] += volume[0] * p[0]
        total[1] += volume[0]
    return {cell: total[0] / total[1] for cell, total in sums.items()}


def alternation(field):
    """The field is filtered by the fourth difference over 16, which keeps what alternates and nothing that is smooth; then
    the mean of what is left, with alternating signs, is the amplitude. The two uppermost rows, where a drained layer may be
    thinner than a cell, are left out."""
    if not field:
        return 0.0
    top = max(j for _, j in field) - 2
    field = {cell: p for cell, p in field.items() if cell[1] <= top}

    def filtered(values, direction):
        step = lambda cell, n: (cell[0] + n, cell[1]) if direction == 0 else (cell[0], cell[1] + n)
        result = {}
        for cell in values:
            stencil = [values.get(step(cell, n)) for n in range(-2, 3)]
            if None not in stencil:
                result[cell] = sum(w * p for w, p in zip((1, -4, 6, -4, 1), stencil)) / 16.0
        return result

    modes = (filtered(field, 0), lambda i, j: i), (filtered(field, 1), lambda i, j: j), (
        filtered(filtered(field, 0), 1), lambda i, j: i + j)
    amplitude = 0.0
    for values, phase in modes:
        if len(values) >= 6:
            amplitude = max(amplitude, abs(sum((-1)**phase(*cell) * p for cell, p in values.items())) / len(values))
    return amplitude
