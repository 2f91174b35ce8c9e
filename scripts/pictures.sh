#!/usr/bin/env bash
# Draws the pictures of README.md and docs/method.md into docs/images with the program in build/release.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
mkdir -p docs/images

picture() {  # NAME FRAME OPTION...
  local folder=examples/data/${2%/*}
  build/release/meniscus extract -q "examples/data/$2" --camera "$folder/camera.json" \
    -o "docs/images/$1.png" "${@:3}"
}

dam=dam/frame_015.ply
spheres=(--method ssm --ssm-sigma 0 --ssm-footprint 1)

picture dam_particles "$dam" "${spheres[@]}"
picture dam_surface "$dam"
picture dam_normals "$dam" --preview normal
picture dam_groups "$dam" --preview groups
picture dam_ssm "$dam" --method ssm
picture dam_paper "$dam" --method paper
picture dam_stable "$dam" --method stable

# Particles as irregular as those of FLIP and MPM.
irregular=$(mktemp -d)
trap 'rm -r "$irregular"' EXIT
build/release/meniscus generate --particles 60000 --noise 0.29 -o "$irregular/dam.ply" -q
irregular_picture() {  # NAME OPTION...
  build/release/meniscus extract -q "$irregular/dam.ply" -o "docs/images/$1.png" --size 800x500 \
    --eye 4.2,2.0,3.2 --target 1.5,0.3,0.75 --fov 35 "${@:2}"
}
irregular_picture irregular
irregular_picture irregular_raw --disorder 0
irregular_picture irregular_anisotropic --method anisotropic
ls -l docs/images
