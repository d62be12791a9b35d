"""The plots of a sweep's page: each function returns a figure, or None if there is nothing to show."""
import math

import numpy as np

from page import plt

COLORS = ("#1f6fb4", "#d1495b", "#2e8b57", "#d98200", "#7a4fa3", "#00838f", "#8d6e63", "#5a6675", "#c2185b", "#9e9d24")
MARKERS = "osD^vP*Xh<"
FRONT = "#111111"


def style(n):
    """Colour and marker of series n."""
    return {"color": COLORS[n % len(COLORS)], "marker": MARKERS[(n // len(COLORS) + n) % len(MARKERS)]}


def decades(values):
    """A logarithmic axis with room around the values, labelled in plain numbers where it spans little."""
    low, high = min(values), max(values)
    margin = max(1.25, (high / low)**0.07)
    return low / margin, high * margin


def percent(value, _=None):
    shown = 100 * value
    return "%g %%" % float("%.2g" % shown) if shown >= 1e-3 else "%.0e %%" % shown


def seconds(value, _=None):
    if value < 1e-3:
        return "%g µs" % float("%.3g" % (1e6 * value))
    if value < 1:
        return "%g ms" % float("%.3g" % (1e3 * value))
    if value < 120:
        return "%g s" % float("%.3g" % value)
    return "%g min" % float("%.3g" % (value / 60)) if value < 7200 else "%g h" % float("%.3g" % (value / 3600))


def label_decades(axis, span, formatter):
    """Ticks at decades, and at 2 and 5 in between where there are few decades."""
    low, high = span
    steps = (1, 2, 5) if math.log10(high / low) < 3.2 else (1,)
    ticks = [m * 10.0**e for e in range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1) for m in steps]
    axis.set_ticks([t for t in ticks if low <= t <= high])
    axis.set_ticks([], minor=True)
    axis.set_major_formatter(formatter)


def has_error(run):
    return run["error"] is not None and run["error"] > 0 and run["seconds"] > 0


def error_against_time(sweep):
    """All finished runs, those of a series joined; the Pareto front and the target."""
    shown = [run for run in sweep.done if has_error(run)]
    if not shown:
        return None
    figure, axes = plt.subplots(figsize=(8.4, 4.9))
    x_span = decades([run["seconds"] for run in shown])
    y_span = decades([run["error"] for run in shown] + [sweep.target])
    front = [run for run in sweep.front() if has_error(run)]
    # The front is a staircase: what is above and to the right of it can be had for less.
    x, y = [], []
    for i, run in enumerate(front):
        x += [run["seconds"]] * 2
        y += [front[i - 1]["error"] if i else y_span[1], run["error"]]
    x.append(x_span[1])
    y.append(front[-1]["error"])
    axes.fill_between(x, y, y_span[1], color="#eef3f8", lw=0, zorder=0)
    axes.plot(x, y, color=FRONT, lw=1.1, ls=(0, (4, 2)), zorder=1, label="Pareto front")
    axes.axhline(sweep.target, color="#2e8b57", lw=1.1, zorder=1)
    axes.annotate("target %s" % percent(sweep.target), (x_span[1], sweep.target), xytext=(-3, 3), ha="right",
                  textcoords="offset points", color="#2e8b57", fontsize=8.5)
    for n, (label, runs) in enumerate(sweep.series.items()):
        runs = [run for run in runs if has_error(run)]
        if not runs:
            continue
        axes.plot([run["seconds"] for run in runs], [run["error"] for run in runs], ls="-", lw=1.2, ms=5.5, mec="white",
                  mew=0.7, zorder=3, label=label, **style(n))
        if sweep.mesh_axis is not None:
            for run in runs:
                axes.annotate(run["values"][sweep.mesh_axis], (run["seconds"], run["error"]), xytext=(5, 4),
                              textcoords="offset points", fontsize=7, color=style(n)["color"])
    axes.plot([run["seconds"] for run in front], [run["error"] for run in front], "o", ms=11, mfc="none", mec=FRONT, mew=1.1,
              zorder=2)
    axes.set(xscale="log", yscale="log", xlim=x_span, ylim=y_span, xlabel="run time (time loop)", ylabel="relative error")
    label_decades(axes.xaxis, x_span, seconds)
    label_decades(axes.yaxis, y_span, percent)
    axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0), title=legend_title(sweep), alignment="left")
    return figure


def legend_title(sweep):
    names = [axis["name"] for i, axis in enumerate(sweep.axes) if i != sweep.mesh_axis and len(axis["values"]) > 1]
    title = ", ".join(names)
    if sweep.mesh_axis is not None:
        title += "%snumbers: %s" % ("\n" if title else "", sweep.axes[sweep.mesh_axis]["name"])
    return title


def convergence(sweep):
    """Each error over the cell size, with a triangle of second order."""
    if sweep.mesh_axis is None:
        return None
    panels = []
    for e, name in enumerate(sweep.errors):
        if any(run["errors"][e] for run in sweep.done if e < len(run["errors"])):
            panels.append((e, name))
    panels = panels[:6]
    if not panels or len({run["cell_size"] for run in sweep.done}) < 2:
        return None
    n_columns = min(3, len(panels))
    n_rows = -(-len(panels) // n_columns)
    figure, axes = plt.subplots(n_rows, n_columns, figsize=(3.7 * max(2, n_columns), 3.1 * n_rows), squeeze=False)
    handles = {}
    for panel in axes.flat[len(panels):]:
        panel.axis("off")
    for panel, (e, name) in zip(axes.flat, panels):
        values = []
        for n, (label, runs) in enumerate(sweep.series.items()):
            runs = [run for run in runs if e < len(run["errors"]) and run["errors"][e]]
            values += [(run["cell_size"], run["errors"][e]) for run in runs]
            handles[label], = panel.plot([run["cell_size"] for run in runs], [run["errors"][e] for run in runs], ls="-",
                                         lw=1.1, ms=4.5, mec="white", mew=0.5, **style(n))
        h, errors = np.array(values).T
        x_span, y_span = decades(h), decades(errors)
        slope(panel, h, errors, 2)
        panel.set(xscale="log", yscale="log", xlim=x_span, ylim=y_span, xlabel="cell size [m]", ylabel="relative error")
        label_decades(panel.xaxis, x_span, lambda value, _: "%g" % float("%.3g" % value))
        label_decades(panel.yaxis, y_span, percent)
        panel.set_title(name, loc="left")
    figure.tight_layout()
    figure.legend(list(handles.values()), list(handles), loc="lower left", bbox_to_anchor=(0.01, 1.0),
                  ncol=min(4, len(handles)), columnspacing=1.4, handlelength=2.2)
    return figure


def slope(panel, h, errors, order):
    """A thin line of that order below the data."""
    ends = np.array([h.min(), h.max()])
    factor = 0.7 * np.min(errors / h**order)
    panel.plot(ends, factor * ends**order, color="#888888", lw=0.9, ls=":")
    panel.annotate("order %d" % order, (ends[1], factor * ends[1]**order), xytext=(-2, -10), ha="right",
                   textcoords="offset points", fontsize=7.5, color="#777777")
