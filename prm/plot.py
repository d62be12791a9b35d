#!/usr/bin/python3
"""Pictures of an output directory without ParaView: plot.py DIR writes DIR/overview.png.

Shows pore pressure (or vertical stress) at the points when it was largest, and the probes over time.
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
    """Positions and named fields of all pieces of a VTU file."""
    positions, fields = [], {}
    for piece in ElementTree.parse(file_name).getroot().iter("Piece"):
        positions.append(decode(piece.find("Points/DataArray")))
        for array in piece.findall("PointData/DataArray"):
            fields.setdefault(array.get("Name"), []).append(decode(array))
    return np.concatenate(positions), {name: np.concatenate(parts) for name, parts in fields.items()}


def field_of(fields):
    if "pressure" in fields:
        return "pore pressure [kPa]", fields["pressure"][:, 0] / 1e3
    stress = fields.get("effective_stress", fields.get("effective stress"))
    return "vertical stress [kPa]", stress[:, 4 if stress.shape[1] == 9 else 1] / 1e3


def draw_points(axes, directory):
    """The points of all bodies when the field was largest; in 3-D those near the plane of smallest y."""
    frames = {}
    for entry in ElementTree.parse(os.path.join(directory, "solution.pvd")).getroot().iter("DataSet"):
        if entry.get("part") != "0":
            frames.setdefault(float(entry.get("timestep")), []).append(os.path.join(directory, entry.get("file")))
    best = None
    for time, files in frames.items():
        parts = [read_points(name) for name in files]
        label, _ = field_of(parts[0][1])
        x = np.concatenate([position for position, _ in parts])
        value = np.concatenate([field_of(fields)[1] for _, fields in parts])
        if best is None or np.abs(value).max() > np.abs(best[3]).max():
            best = (time, label, x, value)
    time, label, x, value = best
    flat = np.ptp(x[:, 2]) == 0
    across = x[:, 2 if flat else 1]
    front = across < across.min() + 0.02 * (np.ptp(across) or 1) + 1e-12 if not flat else np.ones(len(x), bool)
    picture = axes.scatter(x[front, 0], x[front, 1 if flat else 2], c=value[front], s=10, marker="s", cmap="viridis", linewidths=0)
    axes.figure.colorbar(picture, ax=axes, label=label)
    axes.set_aspect("equal")
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]" if flat else "z [m]")
    axes.set_title("t = %.4g s" % time)


def draw_probes(axes, directory, quantity, factor, unit):
    with open(os.path.join(directory, "probes.csv"), newline="") as file:
        rows = list(csv.reader(file))
    names = rows[0]
    data = np.array([[float(v) if v else np.nan for v in row] for row in rows[1:]])
    for column, name in enumerate(names):
        probe, _, field = name.rpartition("/")
        if field.startswith(quantity):
            axes.plot(data[:, 0], factor * data[:, column], label=probe)
    axes.set_xlabel("t [s]")
    axes.set_ylabel("%s [%s]" % (quantity, unit))
    axes.grid(alpha=0.3)
    axes.legend()


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    directory = sys.argv[1]
    figure, axes = plt.subplots(3, 1, figsize=(9, 12), gridspec_kw={"height_ratios": [2, 1, 1]})
    draw_points(axes[0], directory)
    with open(os.path.join(directory, "probes.csv")) as file:
        header = file.readline()
    vertical = "displacement z" if "displacement z" in header else "displacement y"
    draw_probes(axes[1], directory, "pressure" if "/pressure" in header else "effective stress yy", 1e-3, "kPa")
    draw_probes(axes[2], directory, vertical, 1e3, "mm")
    figure.tight_layout()
    figure.savefig(os.path.join(directory, "overview.png"), dpi=110)


if __name__ == "__main__":
    main()
