#!/usr/bin/env python3
"""The page of a sweep: sweep_report.py DIRECTORY writes DIRECTORY/report.html.

The directory is one that `peat sweep` has written. The page holds everything in itself.
"""
import sys

from page import STYLE, count, duration, image, memory, number, table, text, write
from sweep_data import Sweep
import sweep_plots as plots


def percent(value):
    return "–" if value is None else plots.percent(value).replace(" ", "&nbsp;")


def settings_of(sweep, values):
    return ", ".join("%s&nbsp;= %s" % (text(axis["name"]), text(value)) for axis, value in zip(sweep.axes, values) if value)


def verdict(sweep):
    best = sweep.find(sweep.summary["cheapest"])
    target = percent(sweep.target)
    if best:
        fastest = "The cheapest settings for an error of %s are <b>%s</b>: error %s in %s." % (
            target, settings_of(sweep, best["values"]), percent(best["error"]), duration(best["seconds"]))
        dearest = max((run for run in sweep.done if run["error"] is not None and run["error"] <= sweep.target),
                      key=lambda run: run["seconds"])
        if dearest["seconds"] > 1.5 * best["seconds"]:
            fastest += " The dearest that reach it, %s, take %.3g times as long." % (
                settings_of(sweep, dearest["values"]), dearest["seconds"] / best["seconds"])
        return '<p class=verdict>%s</p>' % fastest
    expected = [s for s in sweep.summary["series"] if s["target"]]
    if not expected:
        return '<p class="verdict attention">No run comes to an error of %s.</p>' % target
    first = min(expected, key=lambda s: s["target"]["seconds"])
    return ('<p class="verdict attention">No run comes to an error of %s. By the last two meshes of each series the cheapest '
            'way would be %s with cells of %s m, in about %s.</p>' % (
                target, settings_of(sweep, first["values"]) or "the only scheme", number(first["target"]["cell_size"]),
                duration(first["target"]["seconds"])))


def errors_are(sweep):
    if sweep.summary["finest"]:
        return ("The case names no reference: errors are differences from the finest run, <b>%s</b>, at the probes (relative "
                "%s over time); the largest of all counts. A scheme that converges to something else than the finest "
                "run's looks worse than it is." % (text(sweep.summary["finest"]), sweep.summary["norm"]))
    names = ", ".join("“%s”" % text(name) for name in sweep.errors)
    return "The error of a run is its relative %s error against %s%s." % (
        sweep.summary["norm"], names, "; the largest counts" if len(sweep.errors) > 1 else "")


def target_table(sweep):
    rows = []
    for series in sorted(sweep.summary["series"], key=lambda s: s["target"]["seconds"] if s["target"] else float("inf")):
        cost = series["target"]
        name = text(sweep.label(series["values"]))
        if not cost:
            rows.append([name, "–", "–", "out of reach: the error falls too slowly"])
        else:
            rows.append([name, number(cost["cell_size"]) + " m", duration(cost["seconds"]),
                         "from runs" if cost["is_measured"] else "extrapolated"])
    return rows and table(["", "cell size", "run time", ""], rows, {3}) or ""


def run_table(sweep):
    keys = [i for i, axis in enumerate(sweep.axes)]
    head = [text(axis["name"]) for axis in sweep.axes] + ["error", "time loop", "steps", "points", "unknowns", "memory",
                                                        "step limited by"]
    rows = []
    for run in sorted(sweep.done, key=lambda run: run["seconds"]):
        good = run["error"] is not None and run["error"] <= sweep.target
        error = '<span class=%s>%s<span class=mark>%s</span></span>' % (
            "pass" if good else "quiet", percent(run["error"]), "★" if run["pareto"] else "")
        rows.append([text(run["values"][i]) or "–" for i in keys] + [
            error, duration(run["seconds"]), count(run["steps"]), count(run["points"]), count(run["unknowns"]),
            memory(run["peak_memory_bytes"]), text(run["binding_limit"])])
    note = "<p class=quiet>★ on the Pareto front: no other run is faster and more accurate. Green: within the target.</p>"
    return table(head, rows, set(range(len(keys))) | {len(head) - 1}) + note


def error_table(sweep):
    if len(sweep.errors) < 2:
        return ""
    rows = [[text(run["name"])] + [percent(e) for e in run["errors"]] for run in sweep.done if run["errors"]]
    return "<details><summary>All errors of all runs</summary>%s</details>" % table(
        ["run"] + [text(name) for name in sweep.errors], rows)


def order_table(sweep):
    """Orders over the cell size, and, folded away, those over other numbers."""
    parts = []
    for a, axis in enumerate(sweep.axes):
        orders = [order for order in sweep.summary["orders"] if order["axis"] == a]
        if not orders:
            continue
        over_cells = orders[0]["over_cell_size"]
        content = orders_along(sweep, orders)
        law = "error ~ h<sup>order</sup> over the cell size h" if over_cells else \
            "error ~ value<sup>order</sup> over %s" % text(axis["name"])
        parts.append("<p>%s, least squares of the logarithms:</p>%s" % (law, content) if over_cells else
                     "<details><summary>%s</summary>%s</details>" % (law, content))
    return "\n".join(parts)


def orders_along(sweep, orders):
    groups, quantities = {}, []
    for order in orders:
        if order["quantity"] not in quantities:
            quantities.append(order["quantity"])
        groups.setdefault(tuple(order["values"]), {})[order["quantity"]] = order
    quantities.sort(key=lambda q: q == "time")
    rows = [[settings_of(sweep, values) or "all", str(max(o["runs"] for o in found.values()))] + [
        "%.2f" % found[q]["exponent"] if q in found else "–" for q in quantities] for values, found in groups.items()]
    names = {"largest": "largest error", "time": "run time"}
    return table(["", "runs"] + [text(names.get(q, q)) for q in quantities], rows)


def not_done(sweep):
    parts = []
    for state, title in (("failed", "Failed"), ("refused", "Refused by the case"), ("skipped", "Skipped as not worth while"),
                         ("interrupted", "Not finished")):
        runs = sweep.in_state(state)
        if runs:
            parts.append("<h3>%s</h3>" % title + table(["", "reason"], [[settings_of(sweep, run["values"]), text(run["reason"])]
                                                                        for run in runs], {1}))
    return parts and "<h2>Runs without a result</h2>" + "\n".join(parts) or ""


def page(sweep):
    summary = sweep.summary
    title = "%s: error against run time" % summary["case"]
    varied = "; ".join("%s: %s" % (axis["key"], ", ".join(axis["values"])) for axis in sweep.axes)
    command = 'peat sweep %s %s' % (summary["file"], " ".join('--vary "%s=%s"' % (
        axis["key"], ("; " if any("," in v for v in axis["values"]) else ",").join(axis["values"])) for axis in sweep.axes))
    jobs = "" if summary["jobs"] == 1 else " %d runs ran at a time, so that times are upper bounds." % summary["jobs"]
    parts = ["<!DOCTYPE html><html lang=en><head><meta charset=utf-8><meta name=viewport content='width=device-width, "
             "initial-scale=1'><title>%s</title><style>%s</style></head><body>" % (text(title), STYLE),
             "<h1>%s</h1><p class=quiet>%d runs on one core each, varied: %s. PEAT %s.</p>" % (
                 text(title), len(sweep.done), text(varied), text(summary["version"])),
             verdict(sweep)]
    figure = plots.error_against_time(sweep)
    if figure:
        parts.append(image(figure, "relative error over run time"))
    parts.append("<p class=quiet>%s Runs of one line differ only in the mesh. Shaded: what can be had for less.%s</p>" % (
        errors_are(sweep), jobs))
    targets = target_table(sweep)
    if targets:
        parts.append("<h2>What an error of %s costs</h2>%s" % (percent(sweep.target), targets))
    orders = order_table(sweep)
    figure = plots.convergence(sweep)
    if orders or figure:
        parts += ["<h2>Orders of convergence</h2>", orders, image(figure, "errors over cell size") if figure else ""]
    parts += ["<h2>Runs</h2>", run_table(sweep), error_table(sweep), not_done(sweep),
              "<h2>Again</h2><pre>%s</pre>" % text(command), "</body></html>"]
    return "\n".join(parts)


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    write(sys.argv[1], page(Sweep(sys.argv[1])))


if __name__ == "__main__":
    main()
