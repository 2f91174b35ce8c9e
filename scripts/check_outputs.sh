#!/usr/bin/env bash
# Extracts a frame with every map and every kind of mesh, makes closed meshes of it, and lets programs
# that are not ours check what was written (check_outputs.py, mesh_check.py). They are Python packages,
# which go into BUILD/checks.
#   scripts/check_outputs.sh BUILD
set -euo pipefail
program=$(realpath "$1")/meniscus checks=$(realpath "$1")/checks
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

if [[ ! -e $checks/ready-vtk-usd-manifold ]]; then
  python3 -m venv "$checks"
  "$checks/bin/pip" install -q numpy scipy meshio trimesh OpenEXR vtk usd-core manifold3d
  touch "$checks/ready-vtk-usd-manifold"
fi
"$program" extract "$here/../examples/data/dam/frame_015.ply" --size 320x240 -q \
  --attribute vx --attribute vy --layers 8 \
  -o "$work/f.exr" -o "$work/f.deep.exr" -o "$work/f.ply" -o "$work/f.vtp" -o "$work/f.glb" -o "$work/f.obj" -o "$work/f.stl"
cp "$work/f.ply" "$work/g.0001.ply"
for ending in usda usdc; do
  "$checks/bin/python" "$here/usd_sequence.py" -o "$work/f.$ending" "$work/g.0001.ply"
done
"$checks/bin/python" "$here/check_outputs.py" "$work"/f.*
"$program" mesh "$here/../examples/data/dam/frame_015.ply" -q -o "$work/closed.ply"
"$program" mesh "$here/../examples/data/dam/frame_015.ply" -q --adaptive 0.05 -o "$work/adaptive.ply"
"$checks/bin/python" "$here/mesh_check.py" "$work/closed.ply" "$work/adaptive.ply"
