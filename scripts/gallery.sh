#!/usr/bin/env bash
# Draws violent water by fit, anisotropic kernels and splashsurf side by side, with one camera and one
# shading, whole and zoomed in:
#   scripts/gallery.sh [FOLDER [NAME ...]]
# The pictures are NAME.png and NAME_PART.png in FOLDER, build/gallery unless given. NAME: crown, impact,
# cube_drop_frame_012, dam_frame_015 (all).
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
folder=${1:-build/gallery}
names=("${@:2}")
((${#names[@]})) || names=(crown impact cube_drop_frame_012 dam_frame_015)
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
for name in "${names[@]}"; do
  case $name in
    *_frame_*) "$program" real "examples/data/${name/_frame_//frame_}.ply" --reference none --particle-radius 0.025 "${all[@]}" ;;
    *) "$program" --scene "$name" "${all[@]}" ;;
  esac > "$raw/$name.txt"
done
scripts/gallery.py "$raw" "$folder" "${names[@]}"
