#!/usr/bin/env bash
# Extracts a frame with every map and both kinds of meshes, and lets programs that are not ours check
# what was written (check_outputs.py). They are Python packages, which go into BUILD/checks.
#   scripts/check_outputs.sh BUILD
set -euo pipefail
program=$(realpath "$1")/meniscus checks=$(realpath "$1")/checks
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

if [[ ! -e $checks/ready ]]; then
  python3 -m venv "$checks"
  "$checks/bin/pip" install -q numpy scipy meshio trimesh OpenEXR
  touch "$checks/ready"
fi
"$program" extract "$here/../examples/data/dam/frame_015.ply" --size 320x240 -q \
  -o "$work/f.exr" -o "$work/f.ply" -o "$work/f.obj"
"$checks/bin/python" "$here/check_outputs.py" "$work"/f.*
