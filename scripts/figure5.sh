#!/usr/bin/env bash
# Reproduces figure 5 of the paper, a breaking dam, with a frame of our own: docs/figures.md.
exec "$(dirname "${BASH_SOURCE[0]}")/figure.sh" figure5 examples/data/dam/frame_015.ply
