#!/usr/bin/env bash
# Reproduces figure 6 of the paper, few particles with sharp features, with a frame of our own, a
# cube that drops into a pool: docs/figures.md.
exec "$(dirname "${BASH_SOURCE[0]}")/figure.sh" figure6 examples/data/cube_drop/frame_007.ply
