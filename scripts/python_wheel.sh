#!/usr/bin/env bash
# Builds the wheel of the Python package and puts the libraries it needs into it, so that other
# machines can use it; OpenCL's loader stays the system's.
#   scripts/python_wheel.sh [BUILD] [FOLDER]
# BUILD: a build folder whose library and program are taken; empty: they are built. FOLDER: where the
# wheel goes (default: build/wheels). PYTHON: for which Python (default: python3).
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
built=${1:+$(realpath "$1")} folder=$(realpath -m "${2:-build/wheels}")
tools=$(scripts/python_tools.sh)
export PATH=$tools/bin:$PATH
installed=$PWD/build/python/installed
raw=$(mktemp -d)
trap 'rm -rf "$raw"' EXIT
if [[ -n $built ]]; then
  for component in program library development static; do
    cmake --install "$built" --prefix "$installed" --component $component >"$raw/log"
  done
fi
pip -q --disable-pip-version-check wheel . --no-deps --no-build-isolation -w "$raw" \
  ${built:+-C cmake.define.MENISCUS_INSTALLED="$installed"}
mkdir -p "$folder"
auditwheel -v repair --exclude 'libOpenCL.so*' -w "$folder" "$raw"/*.whl 2>"$raw/log" || { cat "$raw/log" >&2; exit 1; }
ls -l "$raw"/*.whl | awk '{print "as built: " $5 " bytes"}'
ls -l "$folder"/*.whl | awk '{print $9 ": " $5 " bytes"}'
