#!/usr/bin/env bash
# Reproduces figure 5 of the paper, a breaking dam of 35,937 particles: docs/figures.md.
#   scripts/figure5.sh [ROUNDS]
exec "$(dirname "${BASH_SOURCE[0]}")/figure.sh" figure5 examples/data/dam/frame_015.ply \
  examples/data/dam/camera.json "$@"
