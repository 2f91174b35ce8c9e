#!/usr/bin/env python3
"""Puts the results of scripts/real_frames.sh into docs/figures.md.

    scripts/real_frames.py RESULTS.json
"""
import json
import pathlib
import sys

FIGURES = {"angle_median": ("normals on smooth parts, median", "°", 2),
           "angle_p95": ("the same, 95 %", "°", 1),
           "all_p95": ("normals everywhere, 95 %", "°", 1),
           "drift": ("drift", "s", 3)}


def table(rows):
    methods = list(dict.fromkeys(row["method"] for row in rows))
    lines = ["| frame | figure | " + " | ".join(f"`{m}`" for m in methods) + " |",
             "|---|---|" + "--:|" * len(methods)]
    for frame in dict.fromkeys(row["input"] for row in rows):
        of = {row["method"]: row["figures"] for row in rows if row["input"] == frame}
        for name, (what, unit, digits) in FIGURES.items():
            values = [of[m].get(name) for m in methods]
            best = min(v for v in values if v is not None)
            cells = ["–" if v is None else f"{v:.{digits}f}" for v in values]
            cells = [f"**{c}**" if v == best else c for c, v in zip(cells, values)]
            lines.append(f"| {frame} | {what}, {unit} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def main():
    results = json.loads(pathlib.Path(sys.argv[1]).read_text())
    page = pathlib.Path("docs/figures.md")
    head, rest = page.read_text().split("<!-- begin real -->\n")
    tail = rest.split("<!-- end real -->\n")[1]
    page.write_text(head + "<!-- begin real -->\n" + table(results["rows"]) + "\n\nMeasured with "
                    f"version {results['version']} on {results['device']}.\n<!-- end real -->\n" + tail)


main()
