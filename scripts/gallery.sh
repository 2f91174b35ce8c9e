#!/usr/bin/env bash
# Draws violent water by fit, anisotropic kernels and splashsurf side by side, with one camera and one
# shading, whole and zoomed in:
#   scripts/gallery.sh [FOLDER]    the pictures are NAME.png and NAME_PART.png in FOLDER, unless given
#                                  build/gallery
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
folder=${1:-build/gallery}
if ! python3 -c 'import PIL' 2>/dev/null; then
  echo "gallery: python3 with Pillow is needed to put pictures side by side (Debian: python3-pil)" >&2
  exit 1
fi

scripts/setup.sh
cmake --preset release -DMENISCUS_BUILD_BENCHMARKS=ON
cmake --build --preset release --target meniscus_accuracy_program
splashsurf=$(benchmarks/peers/splashsurf.sh)

raw=$folder/raw
mkdir -p "$raw"
all=(--method fit,anisotropic,splashsurf --splashsurf "$splashsurf" --pictures "$raw")
program=build/release/meniscus-accuracy
"$program" --scene crown,impact "${all[@]}" > "$raw/scenes.txt"
"$program" real examples/data/cube_drop/frame_012.ply examples/data/dam/frame_015.ply \
  --reference none --particle-radius 0.025 "${all[@]}" > "$raw/frames.txt"
scripts/gallery.py "$raw" "$folder"
