"""The plots of the page: each function returns a figure, or None if there is nothing to show."""
from matplotlib.ticker import MaxNLocator
import numpy as np

from compare_data import scale
from page import plt

FIRST, SECOND, REFERENCE = "#1f6fb4", "#d1495b", "#222222"


def legend_above(figure, handles, labels, n_columns=6):
    """Above the axes, so that it covers nothing."""
    figure.legend(handles, labels, loc="lower left", bbox_to_anchor=(0.01, 1.0), ncol=min(n_columns, len(labels)),
                  columnspacing=1.4, handlelength=2.2)


def references_of(data, **wanted):
    """Groups of rows of references.csv with these entries, by name of the reference and time."""
    groups = {}
    for row in data.references:
        if all(row[key] == value for key, value in wanted.items()):
            groups.setdefault(row["reference"], []).append(row)
    return groups


def chosen_history_fields(data):
    """Pressure, vertical displacement, vertical velocity (as far as there are), and what references of probes name."""
    axis = "xyz"[data.vertical]
    fields = [f for f in ("pressure", "displacement " + axis, "velocity " + axis) if f in data.fields]
    if "pressure" not in fields:
        fields.insert(0, "effective stress " + 2 * axis)
    for row in data.references:
        if row["kind"] == "history" and row["field"] not in fields:
            fields.append(row["field"])
    return fields


def draw_history(data, field, probe, top, below):
    """Both runs and the reference over time, the difference below. Returns handles of the legend by label."""
    curves = [data.history(run, probe, field) for run in (0, 1)]
    if None in curves:
        top.text(0.5, 0.5, "no values", ha="center", va="center", transform=top.transAxes, color="grey")
        return {}
    factor, unit = scale(curves[0][2], np.concatenate([curves[0][1], curves[1][1]]))
    handles = {}
    for rows in references_of(data, kind="history", field=field, probe=probe).values():
        t = np.array([row["time [s]"] for row in rows])
        values = np.array([row["value"] for row in rows])
        seen = t <= curves[0][0].max() * (1 + 1e-9)
        handles["reference"], = top.plot(t[seen], factor * values[seen], color=REFERENCE, lw=2.6, alpha=0.35)
    for curve, label, color, style in zip(curves, data.labels, (FIRST, SECOND), ("-", "--")):
        handles[label], = top.plot(curve[0], factor * curve[1], style, color=color, lw=1.3)
    top.set_ylabel("%s [%s]" % (field, unit))
    top.set_title(probe, loc="left")
    other = np.interp(curves[0][0], curves[1][0], curves[1][1], right=np.nan)
    difference = other - curves[0][1]
    factor, unit = scale(curves[0][2], difference)
    below.plot(curves[0][0], factor * difference, color="#555555", lw=1)
    below.axhline(0, color="black", lw=0.5)
    below.set_ylabel("diff. [%s]" % unit)
    below.set_xlabel("time [s]")
    return handles


def histories(data, field):
    """One field at all probes, at most three in a row."""
    probes = [p for p in data.probe_names() if None not in (data.history(0, p, field), data.history(1, p, field))][:6]
    if not probes:
        return None
    n_columns = min(3, len(probes))
    n_rows = -(-len(probes) // n_columns)
    figure, axes = plt.subplots(2 * n_rows, n_columns, figsize=(3.7 * max(2, n_columns), 3.3 * n_rows), squeeze=False,
                                sharex=True, gridspec_kw={"height_ratios": [2.4, 1] * n_rows})
    handles = {}
    for n in range(n_rows * n_columns):
        row, column = divmod(n, n_columns)
        top, below = axes[2 * row][column], axes[2 * row + 1][column]
        if n < len(probes):
            handles.update(draw_history(data, field, probes[n], top, below))
        else:
            top.axis("off")
            below.axis("off")
    figure.align_ylabels()
    figure.tight_layout()
    legend_above(figure, list(handles.values()), list(handles))
    return figure


def profile_times(data, field):
    """At most six times: those of references if there are, otherwise spread over the run."""
    wanted = sorted({row["time [s]"] for row in data.references if row["field"] == field and row["kind"] != "history"})
    times = [data.times[np.argmin(np.abs(data.times - t))] for t in wanted]
    if not times:
        times = list(data.times[np.unique(np.linspace(0, len(data.times) - 1, 5).round().astype(int))])
    if len(times) > 6:
        times = [times[i] for i in np.linspace(0, len(times) - 1, 6).round().astype(int)]
    return times


def reference_profile(data, field, line, time):
    """Vertical coordinates and values of profile tables and formulas along the line at that time."""
    axis = "xyz"[data.vertical] + " [m]"
    rows = [row for row in data.references if row["field"] == field and row["kind"] in ("profile", "formula") and
            abs(row["time [s]"] - time) <= 1e-6 * data.times[-1] and np.isfinite(row[axis])]
    inside = []
    for row in rows:
        here = all(not np.isfinite(row[a + " [m]"]) or abs(row[a + " [m]"] - data.middles[d][line["cell"][d]]) < 1e-9
                   for d, a in enumerate("xyz"[:data.vertical]))
        if here:
            inside.append((row[axis], row["value"]))
    inside.sort()
    return np.array(inside).reshape(-1, 2)


def profiles(data, field, line):
    """Both runs along a vertical line at several times, the difference beside."""
    times = profile_times(data, field)
    lines = [[data.line(run, line, field, t) for t in times] for run in (0, 1)]
    lines_finite = [values for run in lines for _, values in run if len(values)]
    if not lines_finite or not np.isfinite(np.concatenate(lines_finite)).any():
        return None
    figure, (left, right) = plt.subplots(1, 2, figsize=(8.2, 3.6), sharey=True, gridspec_kw={"width_ratios": [1.7, 1]})
    factor, unit = scale(data.units[field], np.concatenate(lines_finite))
    colors = plt.cm.viridis(np.linspace(0.0, 0.86, len(times)))
    differences = []
    handles, labels = [], []
    has_reference = False
    for k, (time, color) in enumerate(zip(times, colors)):
        table = reference_profile(data, field, line, time)
        if len(table):
            left.plot(factor * table[:, 1], table[:, 0], color=color, lw=4.5, alpha=0.3)
            has_reference = True
        (y0, v0), (y1, v1) = lines[0][k], lines[1][k]
        handle, = left.plot(factor * v0, y0, color=color, lw=1.3)
        left.plot(factor * v1, y1, "o", color=color, ms=2.8, mfc="white", mew=0.8)
        handles.append(handle)
        labels.append("t = %.4g s" % time)
        common, in_first, in_second = np.intersect1d(y0, y1, return_indices=True)
        differences.append((common, v1[in_second] - v0[in_first]))
    small, small_unit = scale(data.units[field], np.concatenate([d for _, d in differences]))
    for (y, d), color in zip(differences, colors):
        right.plot(small * d, y, color=color, lw=1.1)
    right.axvline(0, color="black", lw=0.5)
    left.set_xlabel("%s [%s]" % (field, unit))
    left.set_ylabel("%s [m]" % "xyz"[data.vertical])
    right.set_xlabel("%s − %s [%s]" % (data.labels[1], data.labels[0], small_unit))
    left.set_title(line["name"], loc="left")
    figure.tight_layout()
    keys = [plt.Line2D([], [], color="grey", lw=1.3),
            plt.Line2D([], [], color="grey", marker="o", ls="", ms=4, mfc="white")]
    if has_reference:
        keys.append(plt.Line2D([], [], color="grey", lw=4.5, alpha=0.35))
    legend_above(figure, keys + handles, data.labels + ["reference"] * has_reference + labels, 5)
    return figure


def maps(data, field, time):
    """The field in both runs and the difference, side by side or below each other."""
    values = [data.map(run, field, time) for run in (0, 1)]
    rows, columns = (np.isfinite(values[0]) | np.isfinite(values[1])).nonzero()
    if not len(rows) or rows.max() == rows.min() or columns.max() == columns.min():
        return None
    box = (slice(rows.min(), rows.max() + 1), slice(columns.min(), columns.max() + 1))
    x = data.planes[0][columns.min():columns.max() + 2]
    y = data.planes[data.vertical][rows.min():rows.max() + 2]
    values = [v[box] for v in values]
    factor, unit = scale(data.units[field], np.concatenate([v.ravel() for v in values]))
    difference = values[1] - values[0]
    small, small_unit = scale(data.units[field], difference)
    aspect = np.ptp(y) / np.ptp(x)
    width = min(4.0, max(2.4, 3.4 / max(aspect, 0.35)))
    figure, axes = plt.subplots(1, 3, figsize=(3 * width, min(5.0, max(1.9, width * aspect * 0.85 + 1.1))), sharey=True)
    low, high = (f([np.nanmin(v) for v in values] if f is min else [np.nanmax(v) for v in values]) for f in (min, max))
    largest = np.nanmax(np.abs(difference)) if np.isfinite(difference).any() else 0.0
    same_colors = dict(cmap="viridis", vmin=factor * low, vmax=factor * high)
    pictures = [(axes[0], factor * values[0], data.labels[0], same_colors, unit),
                (axes[1], factor * values[1], data.labels[1], same_colors, unit),
                (axes[2], small * difference, "%s − %s" % (data.labels[1], data.labels[0]),
                 dict(cmap="RdBu_r", vmin=-small * largest or -1, vmax=small * largest or 1), small_unit)]
    for axis, array, title, colors, name in pictures:
        mesh = axis.pcolormesh(x, y, array, rasterized=True, **colors)
        bar = figure.colorbar(mesh, ax=axis, orientation="horizontal", fraction=0.06, pad=0.22 if aspect < 1.2 else 0.12)
        bar.set_label("%s [%s]" % (field, name))
        bar.locator = MaxNLocator(4)
        bar.update_ticks()
        bar.outline.set_visible(False)
        axis.set_title(title, loc="left")
        axis.set_aspect("equal" if 0.2 < aspect < 5 else "auto")
        axis.set_xlabel("x [m]")
        axis.grid(False)
    axes[0].set_ylabel("%s [m]" % "xyz"[data.vertical])
    figure.tight_layout()
    return figure


ENERGIES = ("kinetic energy", "elastic energy", "fluid energy", "external work", "seepage dissipation",
            "numerical dissipation")


def energies(data):
    """Energies of both runs over time, those that are not nothing."""
    columns = [name for name in ENERGIES if all(name + " [J]" in s for s in data.statistics)]
    largest = max((np.nanmax(np.abs(s[name + " [J]"])) for s in data.statistics for name in columns), default=0)
    columns = [n for n in columns if max(np.nanmax(np.abs(s[n + " [J]"])) for s in data.statistics) > 1e-9 * largest]
    if not columns or largest == 0:
        return None
    n_columns = min(3, len(columns))
    n_rows = -(-len(columns) // n_columns)
    figure, axes = plt.subplots(n_rows, n_columns, figsize=(3.7 * max(2, n_columns), 2.2 * n_rows), squeeze=False, sharex=True)
    for axis in axes.ravel()[len(columns):]:
        axis.axis("off")
    handles = {}
    for axis, name in zip(axes.ravel(), columns):
        factor, unit = scale("J", np.concatenate([s[name + " [J]"] for s in data.statistics]))
        for table, label, color, style in zip(data.statistics, data.labels, (FIRST, SECOND), ("-", "--")):
            handles[label], = axis.plot(table["time [s]"], factor * table[name + " [J]"], style, color=color, lw=1.3)
        axis.set_title(name, loc="left")
        axis.set_ylabel("[%s%s]" % (unit, "/m" if data.dimension == 2 else ""))
    for axis in axes[-1]:
        axis.set_xlabel("time [s]")
    figure.tight_layout()
    legend_above(figure, list(handles.values()), list(handles))
    return figure
