#!/usr/bin/env bash
# Installs what is missing, builds everything and runs the tests.
#   scripts/test.sh [--long] [release|debug|asan]
# --long: those that take long and seldom fail, instead of all others
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
which=(-LE long)
if [[ ${1:-} == --long ]]; then
  which=(-L long)
  shift
fi
preset=${1:-release}

scripts/setup.sh
cmake --preset "$preset"
cmake --build --preset "$preset"
ctest --preset "$preset" -j2 "${which[@]}"
