#!/usr/bin/env bash
# Installs what is missing, builds the program, and extracts the surface of a breaking dam.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

scripts/setup.sh
cmake --preset release
cmake --build --preset release --target meniscus_program

out=build/demo
mkdir -p "$out"
frame=(examples/data/dam/frame_015.ply --camera examples/data/dam/camera.json)
build/release/meniscus extract "${frame[@]}" -o "$out/dam.png" -o "$out/dam.exr" -o "$out/dam.ply"
build/release/meniscus extract -q "${frame[@]}" -o "$out/dam_normals.png" --preview normal

cat <<END

The surface of the dam break is in
  $PWD/$out/dam.png          the picture
  $PWD/$out/dam_normals.png  its normals as colours
  $PWD/$out/dam.exr          depth, normals, positions, groups at every pixel
  $PWD/$out/dam.ply          the mesh
END
