"""What `peat sweep` has written, read for the page."""
import json
import os


class Sweep:
    """A sweep directory."""

    def __init__(self, directory):
        self.directory = directory
        with open(os.path.join(directory, "summary.json"), encoding="utf-8") as file:
            self.summary = json.load(file)
        self.axes = self.summary["axes"]
        self.errors = self.summary["errors"]
        self.mesh_axis = self.summary["mesh_axis"]
        self.target = self.summary["target"]
        self.runs = self.summary["runs"]
        self.done = [run for run in self.runs if run["state"] == "done"]
        self.series = self._series()

    def _series(self):
        """Lists of finished runs that differ in the mesh alone, from coarse to fine, by their label."""
        series = {}
        for run in sorted(self.done, key=lambda run: -run["cell_size"]):
            series.setdefault(self.label(run["values"]), []).append(run)
        return series

    def label(self, values):
        """What distinguishes a series from others: its values on the axes other than the mesh's."""
        words = []
        for i, (axis, value) in enumerate(zip(self.axes, values)):
            several = len(axis["values"]) > 1
            if i == self.mesh_axis or not value or not several:
                continue
            words.append("%s %s" % (axis["name"], value) if axis["numeric"] else value)
        return ", ".join(words) or "all"

    def settings(self, run):
        return ", ".join("%s = %s" % (axis["name"], value) for axis, value in zip(self.axes, run["values"]) if value)

    def front(self):
        return sorted((run for run in self.done if run["pareto"]), key=lambda run: run["seconds"])

    def in_state(self, state):
        return [run for run in self.runs if run["state"] == state]

    def find(self, name):
        return next((run for run in self.runs if run["name"] == name), None)
