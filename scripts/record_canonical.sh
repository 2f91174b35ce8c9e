#!/usr/bin/env bash
# Records the canonical bits of `meniscus verify` anew, after a change that is meant to change bits.
#   scripts/record_canonical.sh [BUILD] [DEVICE]
# BUILD is the build folder (build/release), which is brought up to date first; DEVICE one device
# (all). Every device must agree with the others, and every stage with double precision. The commit
# is recorded, too: commit the change of the kernels before, and src/verify/canonical.bin after it.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
build=${1:-build/release} device=${2:-all}
cmake --build "$build" --target meniscus_program
"$build/meniscus" verify --device "$device" --record src/verify/canonical.bin \
  --commit "$(git describe --always --dirty --exclude '*')"
