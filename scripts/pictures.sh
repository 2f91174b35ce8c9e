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
ls -l docs/images
