#!/usr/bin/env bash
# Measures real frames beside splashsurf's mesh and puts the table into docs/figures.md. Some minutes on
# two cores.
#   scripts/real_frames.sh [FRAME ...]     three of examples/data unless given
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
frames=("$@")
((${#frames[@]})) || frames=(examples/data/dam/frame_015.ply examples/data/cube_drop/frame_007.ply
  examples/data/dam_sequence/dam.0010.ply)
scripts/setup.sh
cmake --preset release -DMENISCUS_BUILD_BENCHMARKS=ON
cmake --build --preset release --target meniscus_accuracy_program
splashsurf=$(benchmarks/peers/splashsurf.sh)
out=build/figures/real
mkdir -p "$out"
build/release/meniscus-accuracy real "${frames[@]}" \
  --method fit,paper,paper-best,ssm,bilateral,narrow-range,curvature-flow,anisotropic,splashsurf \
  --splashsurf "$splashsurf" --json "$out/real.json" > "$out/real.txt"
scripts/real_frames.py "$out/real.json"
