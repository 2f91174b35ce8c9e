#!/usr/bin/env bash
# Draws violent water by fit, anisotropic kernels and splashsurf side by side, with one camera and one
# shading, whole and zoomed in:
#   scripts/gallery.sh [FOLDER [NAME ...]]
# The pictures are NAME.png and NAME_PART.png in FOLDER, build/gallery unless given. NAME: crown, impact,
# wall, gate, cube_drop_frame_012, dam_frame_015, dam_sequence_dam.0012 (all).
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
folder=${1:-build/gallery}
names=("${@:2}")
((${#names[@]})) || names=(crown impact wall gate cube_drop_frame_012 dam_frame_015 dam_sequence_dam.0012)
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
real=(--reference none --particle-radius 0.025)
for name in "${names[@]}"; do
  case $name in
    *_frame_*) of=(real "examples/data/${name/_frame_//frame_}.ply" "${real[@]}") ;;
    *_dam.*) of=(real "examples/data/${name/_dam.//dam.}.ply" "${real[@]}") ;;
    *) of=(--scene "$name") ;;
  esac
  "$program" "${of[@]}" "${all[@]}" > "$raw/$name.txt"
done
scripts/gallery.py "$raw" "$folder" "${names[@]}"
