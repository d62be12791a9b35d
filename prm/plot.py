#!/usr/bin/python3
"""Pictures of an output directory without ParaView: plot.py DIR writes DIR/overview.png.

Shows pore pressure (or vertical stress) at the points when it was largest, the probes over time, and
the forces of contacts.
"""
import base64
import csv
import os
import struct
import sys
import xml.etree.ElementTree as ElementTree
import zlib

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

TYPES = {"Float32": "f4", "Float64": "f8", "Int32": "i4", "UInt32": "u4", "Int64": "i8", "UInt8": "u1"}


def decode(array):
    """A DataArray of a compressed or ASCII VTU file as a numpy array of its tuples."""
    kind = np.dtype(TYPES[array.get("type")])
    components = int(array.get("NumberOfComponents", 1))
    if array.get("format") == "ascii":
        data = np.array(array.text.split(), dtype=kind)
    else:
        text = array.text.strip()
        n_blocks = struct.unpack("<I", base64.b64decode(text[:8])[:4])[0]
        n_header = 4 * ((4 * (3 + n_blocks) + 2) // 3)
        header = np.frombuffer(base64.b64decode(text[:n_header]), dtype="<u4")
        body = base64.b64decode(text[n_header:])
        parts, start = [], 0
        for size in header[3:3 + n_blocks]:
            parts.append(zlib.decompress(body[start:start + size]))
            start += size
        data = np.frombuffer(b"".join(parts), dtype=kind)
    return data.reshape(-1, components)


def read_points(file_name):
    """Positions and named fields of all pieces of a VTU file; of a body that has no points yet, nothing."""
    positions, fields = [np.empty((0, 3))], {}
    for piece in ElementTree.parse(file_name).getroot().iter("Piece"):
        if piece.get("NumberOfPoints", "0") == "0":
            continue
        positions.append(decode(piece.find("Points/DataArray")))
        for array in piece.findall("PointData/DataArray"):
            fields.setdefault(array.get("Name"), []).append(decode(array))
    return np.concatenate(positions), {name: np.concatenate(parts) for name, parts in fields.items()}


def field_of(fields, wet):
    """Label and values of what is shown; None for a body that does not have it."""
    if wet:
        return "pore pressure [kPa]", fields["pressure"][:, 0] / 1e3 if "pressure" in fields else None
    stress = fields.get("effective_stress", fields.get("effective stress"))
    return "vertical stress [kPa]", None if stress is None else stress[:, 4 if stress.shape[1] == 9 else 1] / 1e3


def draw_points(axes, directory):
    """The points of all bodies when the field was largest; in 3-D those next to the plane of its smallest y. Bodies without the
    field, and rigid ones, are grey."""
    frames = {}
    for entry in ElementTree.parse(os.path.join(directory, "solution.pvd")).getroot().iter("DataSet"):
        if entry.get("part") != "0":
            frames.setdefault(float(entry.get("timestep")), []).append(os.path.join(directory, entry.get("file")))
    bodies = {time: [part for part in map(read_points, files) if len(part[0])] for time, files in frames.items()}
    wet = any("pressure" in fields for parts in bodies.values() for _, fields in parts)

    def largest(parts):
        values = [field_of(fields, wet)[1] for _, fields in parts]
        return max((np.abs(v).max() for v in values if v is not None), default=0.)

    time, parts = max(bodies.items(), key=lambda item: largest(item[1]))
    flat = all(np.ptp(x[:, 2]) == 0 for x, _ in parts)
    shown = [x[:, 1] for x, fields in parts if field_of(fields, wet)[1] is not None]
    plane, thickness = min(map(np.min, shown)), 0.02 * max(map(np.ptp, shown)) + 1e-12
    limits = largest(parts)
    for x, fields in parts:
        label, value = field_of(fields, wet)
        distance = np.abs(x[:, 1] - plane)
        front = slice(None) if flat else distance < distance.min() + thickness
        place = x[front, 0], x[front, 1 if flat else 2]
        if value is None:
            axes.scatter(*place, c="0.6", s=6, marker="s", linewidths=0)
        else:
            picture = axes.scatter(*place, c=value[front], s=10, marker="s", cmap="viridis", linewidths=0,
                                   vmin=min(0., value.min()), vmax=max(0., value.max(), 1e-9 * limits))
    axes.figure.colorbar(picture, ax=axes, label=label)
    axes.set_aspect("equal")
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]" if flat else "z [m]")
    axes.set_title("t = %.4g s" % time)


def read_columns(file_name):
    with open(file_name, newline="") as file:
        rows = list(csv.reader(file))

    def number(text):
        try:
            return float(text)
        except ValueError:
            return np.nan

    return rows[0], np.array([[number(v) for v in row] for row in rows[1:]])


def finish(axes, times, label):
    """Axes of a history; time is logarithmic where most of it belongs to a few long steps."""
    if np.median(times) < 0.02 * times[-1]:
        axes.set_xscale("log")
        axes.set_xlim(left=times[times > 0.][0])
    axes.set_xlabel("t [s]")
    axes.set_ylabel(label)
    axes.grid(alpha=0.3)
    axes.legend()


def draw_forces(axes, names, data):
    """The normal force of each contact, and its mean over a fiftieth of the lines."""
    width = max(1, len(data) // 50)
    for column, name in enumerate(names):
        if name.endswith("/normal force [N]"):
            force = np.nan_to_num(data[:, column]) / 1e3
            force = np.pad(force, (width // 2, width - 1 - width // 2), mode="edge")
            mean = np.convolve(force, np.ones(width) / width, mode="valid")
            line = axes.plot(data[:, 0], mean, label=name.split("/")[0])[0]
            axes.plot(data[:, 0], np.nan_to_num(data[:, column]) / 1e3, color=line.get_color(), alpha=0.3, lw=0.7)
    finish(axes, data[:, 0], "normal force [kN]")


def draw_probes(axes, names, data, quantity, factor, unit):
    for column, name in enumerate(names):
        probe, _, field = name.rpartition("/")
        if field.startswith(quantity):
            axes.plot(data[:, 0], factor * data[:, column], label=probe)
    finish(axes, data[:, 0], "%s [%s]" % (quantity, unit))


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    directory = sys.argv[1]
    names, probes = read_columns(os.path.join(directory, "probes.csv"))
    columns, statistics = read_columns(os.path.join(directory, "statistics.csv"))
    touches = any(name.endswith("/normal force [N]") for name in columns)
    ratios = [2, 1, 1, 1] if touches else [2, 1, 1]
    figure, axes = plt.subplots(len(ratios), 1, figsize=(9, 3 * sum(ratios)), gridspec_kw={"height_ratios": ratios})
    draw_points(axes[0], directory)
    has = lambda field: any(name.rpartition("/")[2].startswith(field) for name in names)
    draw_probes(axes[1], names, probes, "pressure" if has("pressure") else "effective stress yy", 1e-3, "kPa")
    draw_probes(axes[2], names, probes, "displacement z" if has("displacement z") else "displacement y", 1e3, "mm")
    if touches:
        draw_forces(axes[3], columns, statistics)
    figure.tight_layout()
    figure.savefig(os.path.join(directory, "overview.png"), dpi=110)


if __name__ == "__main__":
    main()
