"""What `peat compare` has written, read for the page: no computing beyond choosing rows and units."""
import csv
import json
import os

import numpy as np

# Units in which people read: (factor, name) from large to small; the first is taken whose unit the largest value reaches.
UNITS = {
    "Pa": ((1e-6, "MPa"), (1e-3, "kPa"), (1.0, "Pa")),
    "m": ((1.0, "m"), (1e3, "mm"), (1e6, "µm")),
    "m/s": ((1.0, "m/s"), (1e3, "mm/s"), (1e6, "µm/s")),
    "J": ((1e-6, "MJ"), (1e-3, "kJ"), (1.0, "J")),
    "s": ((1.0, "s"), (1e3, "ms"), (1e6, "µs")),
}


def scale(unit, values):
    """Factor and name of the unit in which the largest of the values is about 1 to 1000."""
    finite = np.abs(np.asarray(values, float))
    finite = finite[np.isfinite(finite)]
    largest = finite.max() if len(finite) else 0.0
    choices = UNITS.get(unit, ((1.0, unit or "-"),))
    for factor, name in choices:
        if largest * factor >= 0.5:
            return factor, name
    return choices[-1] if largest > 0 else choices[min(1, len(choices) - 1)]


def read_table(path):
    """Columns of a CSV file by name, numbers where all entries are (NaN: empty); {} if there is no file or no line."""
    if not os.path.exists(path):
        return {}
    with open(path, newline="") as file:
        rows = list(csv.reader(line for line in file if not line.startswith("#")))
    columns = {}
    for name, values in zip(rows[0], zip(*rows[1:])):
        try:
            columns[name] = np.array([float(v) if v else np.nan for v in values])
        except ValueError:
            columns[name] = np.array(values)
    return columns


def split_unit(name):
    """'pressure', 'Pa' of 'pressure [Pa]'."""
    field, _, unit = name.rpartition(" [")
    return field, unit.rstrip("]")


class Data:
    """A comparison directory."""

    def __init__(self, directory):
        self.directory = directory
        with open(os.path.join(directory, "summary.json")) as file:
            self.summary = json.load(file)
        self.runs = self.summary["methods"]
        self.labels = self.summary["labels"]
        self.view = self.summary["view"]
        self.dimension = self.summary["dimension"]
        self.vertical = self.dimension - 1
        self.planes = [np.array(planes) for planes in self.view["planes"]]
        self.middles = [0.5 * (planes[1:] + planes[:-1]) for planes in self.planes]
        with open(os.path.join(directory, "compare.csv"), newline="") as file:
            self.differences = list(csv.DictReader(file))
        self.probes = [read_table(os.path.join(directory, run, "probes.csv")) for run in self.runs]
        self.statistics = [read_table(os.path.join(directory, run, "statistics.csv")) for run in self.runs]
        self.references = self._read_references()
        self._read_samples()

    def _read_references(self):
        with open(os.path.join(self.directory, "references.csv"), newline="") as file:
            rows = list(csv.DictReader(file))
        for row in rows:
            for key in ("time [s]", "x [m]", "y [m]", "z [m]", "value"):
                row[key] = float(row[key]) if row[key] else np.nan
        return rows

    def _read_samples(self):
        """Columns of samples.csv; of each run {field: values}, and the fill of each cell."""
        columns = read_table(os.path.join(self.directory, "samples.csv"))
        self.time, self.body = columns["time [s]"], columns["body"]
        self.cell = np.array([columns["cell " + axis].astype(int) for axis in "ijk"[:self.dimension]])
        self.times = np.unique(self.time)
        # As samples.csv has rounded it.
        self.view["time"] = self.times[np.argmin(np.abs(self.times - self.view["time"]))]
        self.fields, self.units = [], {}
        self.samples = []
        for run in self.runs:
            fields = {}
            for name, values in columns.items():
                if name.startswith(run + "/"):
                    field, unit = split_unit(name[len(run) + 1:])
                    fields[field] = values
                    self.units[field] = unit
            self.samples.append(fields)
        self.fields = [field for field in self.samples[0] if field != "volume"]
        size = np.ones(len(self.time))
        for planes, index in zip(self.planes, self.cell):
            size *= np.diff(planes)[index]
        self.fill = [np.nan_to_num(fields["volume"]) / size for fields in self.samples]

    def probe_names(self):
        names = []
        for name in self.probes[0]:
            probe = name.rpartition("/")[0]
            if probe and probe not in names:
                names.append(probe)
        return names

    def history(self, run, probe, field):
        """Time, values, unit of a probe; None if it has no numbers."""
        for name, values in self.probes[run].items():
            if name.startswith("%s/%s [" % (probe, field)):
                if values.dtype.kind != "f" or not np.isfinite(values).any():
                    return None
                return self.probes[run]["time [s]"], values, split_unit(name)[1]
        return None

    def line(self, run, line, field, time):
        """Vertical coordinates and values of cells in a vertical line that are half full, of all bodies."""
        chosen = (self.time == time) & (self.fill[run] >= self.view["least_fill"])
        for direction, index in enumerate(line["cell"]):
            chosen &= self.cell[direction] == index
        height = self.middles[self.vertical][self.cell[self.vertical][chosen]]
        order = np.argsort(height)
        return height[order], self.samples[run][field][chosen][order]

    def map(self, run, field, time):
        """Values [vertical][horizontal] in the plane of the page, NaN where no body fills half of a cell."""
        chosen = (self.time == time) & (self.fill[run] >= self.view["least_fill"]) & np.isfinite(self.samples[run][field])
        if self.dimension == 3:
            chosen &= self.cell[1] == self.view["cell"][1]
        values = np.full((len(self.middles[self.vertical]), len(self.middles[0])), np.nan)
        values[self.cell[self.vertical][chosen], self.cell[0][chosen]] = self.samples[run][field][chosen]
        return values
