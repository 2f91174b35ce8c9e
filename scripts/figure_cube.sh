#!/usr/bin/env bash
# Draws a cube that drops into a pool, few particles with sharp features, as figures 5 and 6 are drawn:
# docs/figures.md.
#   scripts/figure_cube.sh [ROUNDS]
exec "$(dirname "${BASH_SOURCE[0]}")/figure.sh" cube examples/data/cube_drop/frame_007.ply \
  examples/data/cube_drop/camera.json "$@"
