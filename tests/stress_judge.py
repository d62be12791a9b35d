"""Whether a run of tests/stress.py is sound: what is looked at, and the bounds."""
import math
import os
import re

from scene_tools import read_vtu

MOST_ENERGY = 5e-3      # above the work, over the largest energy
MOST_IMBALANCE = 1e-10  # of momentum and of fluid mass
MOST_IMBALANCE_OF_EQUATIONS = 1e-7  # where motion and pressures follow from equations that are solved to `Newton tolerance`
MOST_LOSS_OF_SOLVES = 1e-9   # of fluid, where pressures are solved for several times in a step, each to `Pressure tolerance`
MOST_CHECKERBOARD = 1e-2  # of the pressures of cells, over the largest
MOST_RIPPLE = 5e-2      # the same at one moment after an impact
# What the program says of a step that was too large.
NAMES_THE_STEP = re.compile(r"'Step factor' [\d.]+ is above the stable step")


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
        return judge_ended(case, run)
    verdict = judge_completed(case, run)
    if case.must_blow_up or (case.too_large and not verdict.is_good):
        return Verdict("FAILED", "a step above the limit is not caught (%s)" % (verdict.reason or "the run ends sound"),
                       **verdict.numbers)
    return verdict


def judge_ended(case, run):
    """What blew up: the message says when and what to change, and there is something to look at."""
    reason = run.message.replace("peat: ", "", 1)
    if not case.too_large:
        return Verdict("FAILED", reason)
    if not NAMES_THE_STEP.search(reason):
        return Verdict("FAILED", "caught, but the step is not named: " + reason)
    if "t = " not in reason or "\n" in reason:
        return Verdict("FAILED", "caught, but not in one line with the time: " + reason)
    folder = os.path.join(run.directory, "pictures")
    pictures = sorted(name for name in os.listdir(folder) if re.match(r"ground-\d+\.vtu$", name))
    written = len(run.table("statistics.csv")["time"]) >= 2 and len(pictures) >= 2 and not run.summary.get("completed", True)
    if not written or not read_vtu(os.path.join(folder, pictures[-1]))["pressure"]:
        return Verdict("FAILED", "caught, but what it came to is not written: " + reason)
    return Verdict("caught", reason)


def judge_completed(case, run):
    table = run.table("statistics.csv")
    # Reports beside a contact that is open hold no gap.
    values = [v for name, column in table.items() if not name.endswith("/gap") for v in column]
    if not all(math.isfinite(v) for v in values) or not run.summary.get("completed"):
        return Verdict("FAILED", "numbers that are not finite")
    gain, gain_at_end = energy_gain(table, case)
    fields = pressures(run)
    numbers = {"energy": gain, "energy at the end": gain_at_end, "momentum": run.summary["balance"]["momentum"],
               "fluid mass": run.summary["balance"]["fluid_mass"], "checkerboard": checkerboard(fields)}
    ripple = 0.0
    if case.scene == "impact":
        numbers["checkerboard"], ripple = standing_checkerboard(fields)
    balance = MOST_IMBALANCE_OF_EQUATIONS if case.settings.get("steps") == "implicit" else MOST_IMBALANCE
    several_solves = case.scene == "impact" and case.settings.get("steps") == "semi-implicit"
    bounds = {"energy": MOST_ENERGY, "momentum": balance,
              "fluid mass": (MOST_LOSS_OF_SOLVES if several_solves else balance) + finite_strain_terms(case, run, largest(fields)), "checkerboard": MOST_CHECKERBOARD}
    wrong = ["%s %.2g" % (name, numbers[name]) for name in bounds if not numbers[name] <= bounds[name]]
    if gain > MOST_ENERGY >= gain_at_end:
        wrong[0] += " (swings; %.1g in the mean of the last quarter)" % gain_at_end
    if not ripple <= MOST_RIPPLE:
        wrong.append("pressures that alternate by %.2g" % ripple)
    if run.summary["lost_points"] != 0:
        wrong.append("lost points")
    return Verdict("FAILED" if wrong else "sound", ", ".join(wrong), **numbers)


def finite_strain_terms(case, run, pressure):
    """In finite strain V n + V p/Q closes up to p/Q times the strain; with implicit pressures V n follows the end of a step and the
    pressure its middle, so what half a step strains comes and goes (theory.md, balances, implicit pore pressure)."""
    if "law" not in case.settings:
        return 0.0
    value = lambda key, usual: case.settings.get(key, usual)
    nu, n = value("nu", 0.3), value("n", 0.4)
    M, Q = 1e7 * (1 - nu) / ((1 + nu) * (1 - 2 * nu)), value("K_f", 2.2e9) / n
    half_step = math.pi / run.summary["steps"] if case.settings.get("steps") == "semi-implicit" else 0.0
    return pressure * (1 / M + 1 / Q) * (pressure / Q + half_step) / n


def energy_gain(table, case):
    """Largest excess of the energy over what has gone in, relative to the largest energy, work or dissipation of the run; and
    the mean of it over the last quarter, which tells energy that comes and goes from energy that grows.

    Explicit and semi-implicit velocities stand half a step before positions: what is booked as work lags behind the stored energy
    by half a step's power of the internal forces. That is known, and taken off."""
    energy = [sum(parts) for parts in zip(table["kinetic energy"], table["elastic energy"], table["fluid energy"])]
    scale = max(energy + [abs(w) for w in table["external work"]] + table["seepage dissipation"])
    if not scale > 0.0:
        return 0.0, 0.0
    missing = list(table["numerical dissipation"])
    if case.settings.get("steps") != "implicit":
        stored = [sum(parts) for parts in zip(table["elastic energy"], table["fluid energy"], table["seepage dissipation"])]
        t = table["time"]
        for i in range(1, len(t) - 1):
            missing[i] += 0.5 * table["dt"][i] * (stored[i + 1] - stored[i - 1]) / (t[i + 1] - t[i - 1])
    last = missing[-(len(missing) // 4):]
    return max(0.0, -min(missing)) / scale, max(0.0, -sum(last) / len(last)) / scale


def pressures(run):
    """Means of cells, for each picture."""
    folder = os.path.join(run.directory, "pictures")
    lower, size = mesh(run)
    return [cell_means(read_vtu(os.path.join(folder, name)), lower, size)
            for name in sorted(os.listdir(folder)) if re.match(r"ground-\d+\.vtu$", name)]


def largest(fields):
    return max((abs(p) for field in fields for p in field.values()), default=0.0)


def checkerboard(fields):
    """Under smooth loads: largest amplitude of pressures of cells that alternate from cell to cell in either direction or in both,
    relative to the largest pressure of all pictures."""
    amplitudes = [abs(a) for field in fields for a in alternation(field).values()]
    return max(amplitudes) / largest(fields) if largest(fields) > 0.0 else 0.0


def standing_checkerboard(fields):
    """After an impact: what alternates in both directions and stays. The front of an impact has all wave lengths; the shortest that
    the mesh carries follow it, and alternate, too, but swing about zero. What nodal forces do not see has nothing that moves it:
    it is what the mean over the time from the first contact on has. Also returns the largest amplitude of all."""
    amplitudes = [alternation(field)["xy"] / largest(fields) for field in fields[1:]] if largest(fields) > 0.0 else [0.0]
    return abs(sum(amplitudes)) / len(amplitudes), max(map(abs, amplitudes))


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
    """For each of both directions, and for both at once: the field is filtered by the fourth difference over 16, which keeps what
    alternates and nothing that is smooth; then the mean of what is left, with alternating signs, is the amplitude. The two uppermost
    rows, where a drained layer may be thinner than a cell, are left out."""
    if not field:
        return {"x": 0.0, "y": 0.0, "xy": 0.0}
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

    def mean(values, phase):
        return sum((-1)**phase(*cell) * p for cell, p in values.items()) / len(values) if len(values) >= 6 else 0.0

    return {"x": mean(filtered(field, 0), lambda i, j: i), "y": mean(filtered(field, 1), lambda i, j: j),
            "xy": mean(filtered(filtered(field, 0), 1), lambda i, j: i + j)}
