"""What the pages of `peat compare` and `peat sweep` share: style, numbers for people, tables, images."""
import base64
import html
import io
import math
import os

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

plt.rcParams.update({
    "font.size": 9, "axes.spines.top": False, "axes.spines.right": False, "axes.grid": True, "grid.alpha": 0.25,
    "axes.titlesize": 9.5, "axes.titleweight": "bold", "legend.frameon": False, "legend.fontsize": 8.5,
    "axes.formatter.useoffset": False, "axes.formatter.limits": (-3, 4), "svg.fonttype": "path", "figure.dpi": 130,
})

STYLE = """
:root { color-scheme: light; }
body { font: 15px/1.5 system-ui, "Segoe UI", Roboto, Helvetica, Arial, sans-serif; color: #1d2530; background: #fff;
  max-width: 1060px; margin: 0 auto; padding: 1.5rem 1.2rem 4rem; }
h1 { font-size: 1.65rem; margin: 0 0 .2rem; line-height: 1.25; }
h2 { font-size: 1.15rem; margin: 2.2rem 0 .5rem; padding-bottom: .25rem; border-bottom: 1px solid #d9dee5; }
h3 { font-size: 1rem; margin: 1.2rem 0 .2rem; }
p, li { max-width: 75ch; }
.quiet { color: #5a6675; }
.verdict { padding: .7rem 1rem; border-left: 4px solid #2e8b57; background: #eef7f1; margin: 1rem 0; }
.verdict.attention { border-color: #d98200; background: #fdf5e6; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; font-size: 13.5px; font-variant-numeric: tabular-nums; margin: .4rem 0; }
th, td { padding: .26rem .8rem .26rem 0; text-align: right; border-bottom: 1px solid #e9edf1; white-space: nowrap; }
th { font-weight: 600; color: #46515f; border-bottom: 1.5px solid #aab4c0; }
td:first-child, th:first-child, td.text, th.text { text-align: left; }
tr.group td { font-weight: 600; padding-top: .8rem; border-bottom: 1px solid #aab4c0; }
.pass { color: #23744a; } span.attention { color: #a85f00; font-weight: 600; }
td .mark { display: inline-block; width: 1.1em; text-align: center; }
img { max-width: 100%; height: auto; display: block; margin: .3rem 0 .9rem; }
pre { background: #f5f7f9; padding: .8rem; overflow-x: auto; font-size: 12.5px; line-height: 1.4; }
li { margin-bottom: .45rem; }
summary { cursor: pointer; }
@media print { body { max-width: none; } h2, img, tr { break-inside: avoid; } }
"""


def text(value):
    return html.escape(str(value))


def number(value):
    return "–" if value is None or value == "" or not math.isfinite(float(value)) else "%.4g" % float(value)


def count(value):
    return "{:,.0f}".format(value).replace(",", "\u202f")


def duration(seconds):
    if seconds < 120:
        return "%.3g s" % seconds
    return "%.3g min" % (seconds / 60) if seconds < 7200 else "%.3g h" % (seconds / 3600)


def memory(size):
    return "%.3g MB" % (size / 1e6) if size < 1e9 else "%.3g GB" % (size / 1e9)


def table(head, rows, texts=()):
    """Rows are lists of HTML; a string is the heading of a group. `texts`: columns that hold words."""
    kind = lambda i: ' class="text"' if i in texts else ""
    lines = ["<div class=scroll><table><tr>" + "".join("<th%s>%s</th>" % (kind(i), h) for i, h in enumerate(head)) + "</tr>"]
    for row in rows:
        if isinstance(row, str):
            lines.append('<tr class=group><td colspan=%d>%s</td></tr>' % (len(head), row))
        else:
            lines.append("<tr>" + "".join("<td%s>%s</td>" % (kind(i), c) for i, c in enumerate(row)) + "</tr>")
    return "\n".join(lines) + "</table></div>"


def image(figure, text):
    """The figure as an <img> with everything in it."""
    stream = io.BytesIO()
    figure.savefig(stream, format="svg", bbox_inches="tight")
    plt.close(figure)
    return '<img alt="%s" src="data:image/svg+xml;base64,%s">' % (text, base64.b64encode(stream.getvalue()).decode())


def write(directory, content):
    """DIRECTORY/report.html, complete once it has its name."""
    path = os.path.join(directory, "report.html")
    with open(path + ".tmp", "w", encoding="utf-8") as file:
        file.write(content)
    os.replace(path + ".tmp", path)
