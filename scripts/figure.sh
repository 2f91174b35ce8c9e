#!/usr/bin/env bash
# Draws a frame with ssm, paper and fit side by side into docs/images/NAME.png and puts the times
# into docs/figures.md. Called by figure5.sh and figure6.sh:
#   scripts/figure.sh NAME FRAME
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
name=$1
frame=$2
if ! python3 -c 'import PIL' 2>/dev/null; then
  echo "figure: python3 with Pillow is needed to put pictures side by side (Debian: python3-pil)" >&2
  exit 1
fi

scripts/setup.sh
cmake --preset release -DMENISCUS_BUILD_BENCHMARKS=ON
cmake --build --preset release --target meniscus_accuracy_program

# Every method extracts five times, with the mesh: the time is the shortest.
out=build/figures/$name
mkdir -p "$out"
build/release/meniscus-accuracy real "$frame" --reference none --method ssm,paper,fit --mesh \
  --pictures "$out" --json "$out/times.json" > "$out/times.txt"
scripts/figure.py "$name" "$out"
