#!/usr/bin/env bash
# Measures meniscus beside splashsurf (smooth) and VTK's fluid mapper on the dam's frame, turn by
# turn, and prints wall times, processor times and ratios; build/peers/results.json has them all.
#   benchmarks/peers/run.sh [MENISCUS [ROUNDS]]    the program is build/release/meniscus unless given
# The peers come from PyPI into a folder of their own, build/peers. VTK renders off screen by EGL
# (Debian: libegl1 libgl1-mesa-dri), on the processor unless there is a GPU.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
program=${1:-build/release/meniscus}
rounds=${2:-3}

if [[ ! -x $program ]]; then
  echo "run.sh: $program is not there: build it (scripts/test.sh), or name one" >&2
  exit 1
fi
benchmarks/peers/splashsurf.sh build/peers > /dev/null
python=build/peers/bin/python
"$python" -c 'import vtk' 2> /dev/null || "$python" -m pip install --quiet 'vtk==9.7.2' >&2
exec "$python" benchmarks/peers/compare.py "$program" examples/data/dam/frame_015.ply \
  examples/data/dam/camera.json build/peers/results.json "$rounds"
