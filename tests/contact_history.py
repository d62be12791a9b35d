"""What runs with contacts wrote, for the scripts that judge it."""
import os

from scene_tools import TABLES, interpolate


class History:
    """statistics.csv of a run: times, lengths of steps, the force of one contact (of each step, at its end)."""

    def __init__(self, run, contact):
        self.table = run.table("statistics.csv")
        self.t = self.table["time"]
        self.force = [abs(f) for f in self.table[contact + "/normal force"]]
        self.gap = self.table[contact + "/gap"]
        self.impulse = self.integral(self.force)

    def integral(self, values):
        """Over time, from the first line to each; values hold from the line before to their own."""
        sums = [0.]
        for i in range(1, len(self.t)):
            sums.append(sums[-1] + (self.t[i] - self.t[i - 1]) * values[i])
        return sums

    def touch(self):
        """Begin of the first step with a force, and the length of that step."""
        i = next(i for i, f in enumerate(self.force) if f > 0.)
        return self.t[i - 1], self.t[i] - self.t[i - 1]

    def release(self, share=0.):
        """End of the last step with a force above this share of the largest."""
        return self.t[max(i for i, f in enumerate(self.force) if f > share * max(self.force))]

    def mean(self, begin, end, values=None):
        """Mean over time, of the force or of values on the lines."""
        sums = self.integral(values) if values else self.impulse
        return (interpolate(end, self.t, sums) - interpolate(begin, self.t, sums)) / (end - begin)

    def averaged(self, width):
        """Means over windows around all times that have a whole one: [(time, mean)]."""
        return [(t, self.mean(t - 0.5 * width, t + 0.5 * width)) for t in self.t
                if self.t[0] <= t - 0.5 * width and t + 0.5 * width <= self.t[-1]]

    def energy(self):
        """Of motion, skeleton and fluid."""
        return [sum(values) for values in zip(*(self.table[k] for k in ("kinetic energy", "elastic energy", "fluid energy")))]

    def deepest(self):
        return max([-g for g in self.gap if g == g] + [0.])


def mean_velocity(run, body):
    points = run.points(body.replace(" ", "_"))
    mass = sum(m for m, in points["mass"])
    return [sum(v[d] * m for v, (m,) in zip(points["velocity"], points["mass"])) / mass for d in range(3)]


def constants(scene, names):
    """Numbers that a table's head gives: {name: value}."""
    found = {}
    with open(os.path.join(TABLES, scene + ".csv")) as file:
        for line in file:
            if line.startswith("# ") and " = " in line:
                name, value = line[2:].split(" = ")
                if name in names:
                    found[name] = float(value)
    return found
