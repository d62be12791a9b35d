#!/usr/bin/env python3
"""The page of a comparison: compare_report.py DIRECTORY writes DIRECTORY/report.html.

The directory is one that `peat compare` has written. The page holds everything in itself.
"""
import os
import sys

from compare_data import Data
from page import STYLE, count, duration, image, memory, number, table, text, write
import compare_plots as plots


def cost(data):
    summaries = [data.summary["runs"][run] for run in data.runs]
    rows = [
        ("settings", lambda s, i: text(data.summary["settings"][i])),
        ("points", lambda s, i: count(s["points"])),
        ("cells with material", lambda s, i: count(s["active_cells"])),
        ("unknowns on the nodes", lambda s, i: count(s["dofs"])),
        ("steps", lambda s, i: count(s["steps"])),
        ("mean step", lambda s, i: number(s["dt"]["mean"]) + " s"),
        ("step is limited by", lambda s, i: text(s["dt"]["binding_limit"])),
        ("wall time", lambda s, i: duration(s["wall_seconds"]["total"])),
        ("&emsp;of it the time loop", lambda s, i: duration(s["wall_seconds"]["time_loop"])),
        ("peak memory, all ranks", lambda s, i: memory(s["peak_memory_bytes"])),
        ("ranks", lambda s, i: count(s["ranks"])),
        ("error of the energy balance", lambda s, i: number(s["balance"]["energy"])),
        ("error of the momentum balance", lambda s, i: number(s["balance"]["momentum"])),
    ]
    return table([""] + [text(label) for label in data.labels],
                 [[name] + [cell(s, i) for i, s in enumerate(summaries)] for name, cell in rows])


def share(row, norm, tolerance):
    """A relative difference with its mark."""
    if row["above tolerance"] == "negligible":
        return '<span class=quiet>round-off</span>'
    if not row["relative " + norm]:
        return "–"
    value = float(row["relative " + norm])
    above = value > tolerance
    shown = "0 %" if value == 0 else ("%.3g %%" % (100 * value) if value >= 1e-6 else "&lt; 0.0001 %")
    return '<span class=%s>%s<span class=mark>%s</span></span>' % (
        "attention" if above else "pass", shown, "▲" if above else "✓")


def place(row):
    if row["kind"] == "probe" or not row["worst x [m]"]:
        return ""
    return "(%s) m" % ", ".join("%.4g" % float(row["worst %s [m]" % a]) for a in "xyz" if row["worst %s [m]" % a])


def difference_rows(data, rows, name):
    tolerance = data.summary["tolerance"]
    result = []
    for row in rows:
        seen = "%s of %s" % (count(int(row["compared"])), count(int(row["compared"]) + int(row["left out"])))
        factor, unit = plots.scale(row["unit"], [float(row["value"] or 0), float(row["value subtracted"] or 0)])
        values = ["%.4g" % (factor * float(row[key])) if row[key] else "–" for key in ("value subtracted", "value")]
        result.append([text(name(row)), share(row, "L2", tolerance), share(row, "Linf", tolerance),
                       number(row["worst time [s]"]), place(row)] + values + [text(unit), seen])
    return result


def differences(data):
    """The tables of differences: cells of all bodies, of each body, references, probes."""
    pair = "%s-%s" % (data.runs[1], data.runs[0])
    first, second = map(text, data.labels)
    head = lambda one, two: ["", "L2", "L∞", "t [s]", "largest at", one, two, "", "compared"]
    rows = []
    for body in [""] + data.summary["bodies"]:
        chosen = [r for r in data.differences if r["runs"] == pair and r["kind"] == "cells" and r["name"] == body]
        if chosen:
            several = not body and len(data.summary["bodies"]) > 1
            rows.append("All bodies" if several else "Body '%s'" % text(body or data.summary["bodies"][0]))
            rows += difference_rows(data, chosen, lambda r: r["field"])
    parts = ["<h3>%s against %s, means over cells</h3>" % (second, first), table(head(first, second), rows, {4, 7})]

    rows = []
    for run, label in zip(data.runs, data.labels):
        chosen = [r for r in data.differences if r["runs"] == run + "-reference"]
        if chosen:
            rows.append(text(label))
            rows += difference_rows(data, chosen, lambda r: "%s (%s, %s)" % (r["name"], r["field"], r["kind"]))
    if rows:
        parts += ["<h3>Each against the references of the case</h3>", table(head("reference", "run"), rows, {4, 7})]

    rows = []
    for probe in data.probe_names():
        chosen = [r for r in data.differences if r["runs"] == pair and r["kind"] == "probe" and r["name"] == probe]
        if chosen:
            rows.append("Probe '%s'" % text(probe))
            rows += difference_rows(data, chosen, lambda r: r["field"])
    if rows:
        parts.append("<details><summary>%s against %s at the probes</summary>%s</details>" % (
            second, first, table(head(first, second), rows, {4, 7})))
    parts.append(
        "<p class=quiet>L2: root of the mean square of the difference over time and volume, divided by that of the whole "
        "quantity (all components of a vector or stress). L∞: largest difference, divided by the largest magnitude. "
        "References are divided by their own scale. Left out are cells that a body fills to less than half in either run. "
        "▲ above the tolerance of %.3g %%, ✓ below.</p>" % (100 * data.summary["tolerance"]))
    return "\n".join(parts)


def verdict(data):
    main = [r for r in data.differences if r["kind"] == "cells" and not r["name"]]
    above = [r["field"] for r in main if r["relative L2"] and float(r["relative L2"]) > data.summary["tolerance"]]
    first, second = map(text, data.labels)
    tolerance = "%.3g %%" % (100 * data.summary["tolerance"])
    if above:
        return '<p class="verdict attention">%s and %s differ by more than %s (L2 over time and volume) in: %s.</p>' % (
            first, second, tolerance, ", ".join(map(text, above)))
    local = any(r["above tolerance"] == "yes" for r in main)
    return '<p class="verdict">%s and %s agree within %s (L2 over time and volume) in all fields%s.</p>' % (
        first, second, tolerance, "; the largest local differences are above it" if local else "")


def findings(data):
    sentences = data.summary["findings"]
    if not sentences:
        return "<p>No difference is above the tolerance anywhere.</p>"
    items = ["<li>%s</li>" % text(sentence).replace(" %", "&nbsp;%").replace("= ", "=&nbsp;") for sentence in sentences]
    most = 8
    shown = "<ul>%s</ul>" % "\n".join(items[:most])
    if len(items) > most:
        shown += "<details><summary>%d more</summary><ul>%s</ul></details>" % (len(items) - most, "\n".join(items[most:]))
    return shown


def settings(data):
    parts = []
    for run, label in zip(data.runs, data.labels):
        with open(os.path.join(data.directory, run, "parameters.prm")) as file:
            parts.append("<details><summary>All parameters of %s (%s/parameters.prm)</summary><pre>%s</pre></details>" % (
                text(label), text(run), text(file.read())))
    return "\n".join(parts)


def figures(data):
    """Pairs of heading and images."""
    view, axis = data.view, "xyz"[data.vertical]
    sections = []
    where = "" if data.dimension == 2 else ", in the plane y = %.4g m" % data.middles[1][view["cell"][1]]
    picture = plots.maps(data, view["field"], view["time"])
    if picture:
        sections.append(("The field when it is largest", "<p>%s at t = %.4g s%s.</p>%s" % (
            text(view["field"].capitalize()), view["time"], where, image(picture, view["field"]))))
    images = [image(f, field) for field in plots.chosen_history_fields(data)
              for f in [plots.histories(data, field)] if f]
    if images:
        sections.append(("Histories at the probes", "".join(images)))
    fields = [view["field"], "displacement " + axis]
    fields += sorted({row["field"] for row in data.references if row["kind"] != "history"} & set(data.fields) - set(fields))
    images = [image(f, field) for line in view["lines"] for field in fields
              for f in [plots.profiles(data, field, line)] if f]
    if images:
        sections.append(("Profiles along vertical lines", "".join(images)))
    picture = plots.energies(data)
    if picture:
        sections.append(("Energies", image(picture, "energies")))
    return sections


def problems(data):
    return "".join("<p class='verdict attention'>The run %s ended early, and what follows ends with it: %s</p>" % (text(label), text(problem))
                   for label, problem in zip(data.labels, data.summary["problems"]) if problem)


def page(data):
    title = "%s: %s and %s" % (data.summary["case"], data.labels[0], data.labels[1])
    intro = "%d-D, %s s simulated, %d sample times, %s. PEAT %s." % (
        data.dimension, number(data.summary["simulated_time"]), len(data.summary["sample_times"]),
        "1 body" if len(data.summary["bodies"]) == 1 else "%d bodies" % len(data.summary["bodies"]), data.summary["version"])
    parts = ["<!DOCTYPE html><html lang=en><head><meta charset=utf-8><meta name=viewport content='width=device-width, "
             "initial-scale=1'><title>%s</title><style>%s</style></head><body>" % (text(title), STYLE),
             "<h1>%s</h1><p class=quiet>Comparison of %s and %s. %s</p>" % (
                 text(data.summary["case"]), text(data.labels[0]), text(data.labels[1]), text(intro)),
             problems(data), verdict(data), "<h2>Where they differ most</h2>", findings(data)]
    sections = figures(data)
    parts += ["<h2>%s</h2>%s" % (text(name), content) for name, content in sections[:1]]
    parts += ["<h2>Cost</h2>", cost(data), "<h2>Differences</h2>", differences(data)]
    parts += ["<h2>%s</h2>%s" % (text(name), content) for name, content in sections[1:]]
    parts += ["<h2>Settings</h2>", settings(data), "</body></html>"]
    return "\n".join(parts)


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    write(sys.argv[1], page(Data(sys.argv[1])))


if __name__ == "__main__":
    main()
