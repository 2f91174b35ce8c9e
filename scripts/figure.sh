#!/usr/bin/env bash
# Draws a frame with ssm, paper, paper-best and fit side by side into docs/images/NAME.png, measures ssm,
# paper and fit in turns, and puts times and ratios into docs/figures.md. Called by figure5.sh,
# figure6.sh and figure_cube.sh:
#   scripts/figure.sh NAME FRAME CAMERA [ROUNDS]
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
name=$1 frame=$2 camera=$3 rounds=${4:-5}
if ! python3 -c 'import PIL' 2>/dev/null; then
  echo "figure: python3 with Pillow is needed to put pictures side by side (Debian: python3-pil)" >&2
  exit 1
fi

scripts/setup.sh
cmake --preset release -DMENISCUS_BUILD_BENCHMARKS=ON
cmake --build --preset release --target meniscus_accuracy_program meniscus_program

out=build/figures/$name
mkdir -p "$out"
build/release/meniscus-accuracy real "$frame" --camera "$camera" --reference none \
  --method ssm,paper,paper-best,fit --pictures "$out" > "$out/real.txt"
# In turns, so that other work on the machine slows all of them.
for ((round = 1; round <= rounds; ++round)); do
  for mesh in "" --mesh; do
    build/release/meniscus bench frame "$frame" --camera "$camera" --method ssm,paper,fit $mesh \
      --seconds 0.5 --frames 3 --in-flight 1 --json "$out/times$mesh-$round.json" > /dev/null
  done
done
scripts/figure.py "$name" "$out" "$rounds"
