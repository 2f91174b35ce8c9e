#!/usr/bin/env python3
"""Puts the pictures of scripts/figure.sh side by side, and times and ratios into docs/figures.md.

    scripts/figure.py NAME FOLDER ROUNDS    FOLDER has *_METHOD_{lit,normal}.png, and of each round
                                            times-K.json and times--mesh-K.json of bench frame
"""
import json
import pathlib
import statistics
import sys

from PIL import Image, ImageChops

DRAWN = ["ssm", "paper", "paper-best", "fit"]
TIMED = ["ssm", "paper", "fit"]
WIDTH = 480  # pixels of each picture
MARGIN = 24  # pixels around the fluid, before the picture is made smaller
GAP = 6


def picture(folder, method, kind):
    (path,) = folder.glob(f"*_{method}_{kind}.png")
    return Image.open(path).convert("RGB")


def fluid_box(normals):
    """The pixels that a method covers: a picture of normals has one colour elsewhere."""
    background = Image.new("RGB", normals.size, normals.getpixel((0, 0)))
    return ImageChops.difference(normals, background).getbbox()


def crop_box(folder, size):
    boxes = [fluid_box(picture(folder, method, "normal")) for method in DRAWN]
    return (max(0, min(box[0] for box in boxes) - MARGIN),
            max(0, min(box[1] for box in boxes) - MARGIN),
            min(size[0], max(box[2] for box in boxes) + MARGIN),
            min(size[1], max(box[3] for box in boxes) + MARGIN))


def side_by_side(folder):
    """Two in a row."""
    lit = [picture(folder, method, "lit") for method in DRAWN]
    box = crop_box(folder, lit[0].size)
    height = round(WIDTH * (box[3] - box[1]) / (box[2] - box[0]))
    sheet = Image.new("RGB", (2 * WIDTH + GAP, 2 * height + GAP), "white")
    for k, image in enumerate(lit):
        small = image.crop(box).resize((WIDTH, height), Image.LANCZOS)
        sheet.paste(small, (k % 2 * (WIDTH + GAP), k // 2 * (height + GAP)))
    return sheet.quantize(256, dither=Image.FLOYDSTEINBERG, palette=sheet.quantize(256))


def table(folder, rounds):
    """Medians over the rounds; ratios are of each round, so that other work slows both sides."""
    lines = ["| | `ssm` | `paper` | `fit` | `paper` / `ssm` | `fit` / `ssm` |",
             "|---|--:|--:|--:|--:|--:|"]
    for mesh, with_mesh in ("", "depth and normals"), ("--mesh", "with the mesh"):
        runs = [json.loads((folder / f"times{mesh}-{k}.json").read_text())
                for k in range(1, rounds + 1)]
        for key, what in ("cpu_ms", "processor time"), ("median_ms", "wall time"):
            ms = [{r["method"]: r[key] for r in run["results"]} for run in runs]
            cells = [f"{statistics.median(m[method] for m in ms):.0f} ms" for method in TIMED]
            cells += [f"{statistics.median(m[method] / m['ssm'] for m in ms):.1f}"
                      for method in TIMED[1:]]
            lines.append(f"| {what}, {with_mesh} | " + " | ".join(cells) + " |")
    return "\n".join(lines + ["", f"{rounds} rounds with version {runs[0]['version']} on "
                                  f"{runs[0]['device']}."])


def between_markers(text, name, new):
    begin, end = f"<!-- begin {name} -->\n", f"<!-- end {name} -->\n"
    head, rest = text.split(begin)
    return head + begin + new + "\n" + end + rest.split(end)[1]


def main():
    name, folder, rounds = sys.argv[1], pathlib.Path(sys.argv[2]), int(sys.argv[3])
    image = pathlib.Path("docs/images", name + ".png")
    side_by_side(folder).save(image, optimize=True)
    page = pathlib.Path("docs/figures.md")
    page.write_text(between_markers(page.read_text(), name, table(folder, rounds)))
    print(f"figure: {image} has the pictures, {page} the times")


main()
