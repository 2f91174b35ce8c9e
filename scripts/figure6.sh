#!/usr/bin/env bash
# Reproduces figure 6 of the paper, a breaking dam of few particles: docs/figures.md.
#   scripts/figure6.sh [ROUNDS]
exec "$(dirname "${BASH_SOURCE[0]}")/figure.sh" figure6 examples/data/dam_sequence/dam.0010.ply \
  examples/data/dam_sequence/camera.json "$@"
