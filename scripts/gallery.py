#!/usr/bin/env python3
"""Puts the pictures of scripts/gallery.sh side by side.

    scripts/gallery.py RAW FOLDER NAME ...    RAW has NAME_METHOD*_lit.png
"""
import pathlib
import sys

from PIL import Image

METHODS = ("fit", "anisotropic", "splashsurf")
WIDTH = 480  # pixels of each picture
GAP = 6
# Of each input: what is shown, as shares of the width and the height: left, top, right, bottom.
PARTS = {
    "crown": {"": (0.02, 0, 0.98, 0.98), "fingers": (0.02, 0.05, 0.42, 0.47)},
    "impact": {"": (0.05, 0.12, 0.95, 1), "rim": (0.15, 0.3, 0.55, 0.72)},
    "wall": {"": (0.05, 0.05, 0.95, 1)},
    "gate": {"": (0.05, 0.05, 0.95, 1)},
    "cube_drop_frame_012": {"": (0.17, 0.24, 0.83, 0.88), "rim": (0.24, 0.3, 0.5, 0.62)},
    "dam_frame_015": {"": (0.12, 0.12, 1, 1), "drops": (0.72, 0.14, 1, 0.5)},
    "dam_sequence_dam.0012": {"": (0.2, 0.15, 0.9, 0.95), "arms": (0.55, 0.35, 0.92, 0.85)},
}


def picture(raw, name, method):
    (path,) = raw.glob(f"{name}_{method}*_lit.png")
    return Image.open(path).convert("RGB")


def side_by_side(pictures, part):
    width, height = pictures[0].size
    box = [round(share * side) for share, side in zip(part, (width, height, width, height))]
    tall = round(WIDTH * (box[3] - box[1]) / (box[2] - box[0]))
    sheet = Image.new("RGB", (len(pictures) * (WIDTH + GAP) - GAP, tall), "white")
    for k, image in enumerate(pictures):
        # Enlarged by repeating pixels, so that none is made up.
        zoom = Image.NEAREST if box[2] - box[0] < WIDTH else Image.LANCZOS
        sheet.paste(image.crop(box).resize((WIDTH, tall), zoom), (k * (WIDTH + GAP), 0))
    return sheet


def main():
    raw, folder = map(pathlib.Path, sys.argv[1:3])
    for name in sys.argv[3:]:
        pictures = [picture(raw, name, method) for method in METHODS]
        for part, box in PARTS[name].items():
            path = folder / ("_".join(filter(None, (name, part))) + ".png")
            side_by_side(pictures, box).save(path, optimize=True)
            print(path)


if __name__ == "__main__":
    main()
