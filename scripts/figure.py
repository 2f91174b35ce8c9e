#!/usr/bin/env python3
"""Puts the pictures of scripts/figure.sh side by side and their times into docs/figures.md.

    scripts/figure.py NAME FOLDER    FOLDER has times.json and *_METHOD_{lit,normal}.png
"""
import json
import pathlib
import sys

from PIL import Image, ImageChops

WIDTH = 560  # pixels of each picture
MARGIN = 24  # pixels around the fluid, before the picture is made smaller
GAP = 6


def picture(folder, method, kind):
    (path,) = folder.glob(f"*_{method}_{kind}.png")
    return Image.open(path).convert("RGB")


def fluid_box(normals):
    """The pixels that a method covers: a picture of normals has one colour elsewhere."""
    background = Image.new("RGB", normals.size, normals.getpixel((0, 0)))
    return ImageChops.difference(normals, background).getbbox()


def crop_box(folder, methods, size):
    boxes = [fluid_box(picture(folder, method, "normal")) for method in methods]
    return (max(0, min(box[0] for box in boxes) - MARGIN),
            max(0, min(box[1] for box in boxes) - MARGIN),
            min(size[0], max(box[2] for box in boxes) + MARGIN),
            min(size[1], max(box[3] for box in boxes) + MARGIN))


def side_by_side(folder, methods):
    lit = [picture(folder, method, "lit") for method in methods]
    box = crop_box(folder, methods, lit[0].size)
    height = round(WIDTH * (box[3] - box[1]) / (box[2] - box[0]))
    sheet = Image.new("RGB", (len(lit) * (WIDTH + GAP) - GAP, height), "white")
    for k, image in enumerate(lit):
        small = image.crop(box).resize((WIDTH, height), Image.LANCZOS)
        sheet.paste(small, (k * (WIDTH + GAP), 0))
    return sheet.quantize(256, dither=Image.FLOYDSTEINBERG, palette=sheet.quantize(256))


def table(results):
    columns = [row["method"] for row in results["rows"]]
    seconds = [row["figures"]["time"] / 1000 for row in results["rows"]]
    return "\n".join([
        "| | " + " | ".join(f"`{method}`" for method in columns) + " |",
        "|---|" + "--:|" * len(columns),
        "| time of a frame | " + " | ".join(f"{1000 * s:.0f} ms" for s in seconds) + " |",
        "| frames a second | " + " | ".join(f"{1 / s:.1f}" for s in seconds) + " |",
        "",
        f"Measured with version {results['version']} on {results['device']}.",
    ])


def between_markers(text, name, new):
    begin, end = f"<!-- begin {name} -->\n", f"<!-- end {name} -->\n"
    head, rest = text.split(begin)
    return head + begin + new + "\n" + end + rest.split(end)[1]


def main():
    name, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    results = json.loads((folder / "times.json").read_text())
    image = pathlib.Path("docs/images", name + ".png")
    side_by_side(folder, [row["method"] for row in results["rows"]]).save(image, optimize=True)
    page = pathlib.Path("docs/figures.md")
    page.write_text(between_markers(page.read_text(), name, table(results)))
    print(f"figure: {image} has the pictures, {page} the times")


main()
