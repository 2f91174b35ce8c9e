#!/usr/bin/env bash
# Builds the Python package around a library that is built already, installs its wheel in a fresh
# environment, tests it there, away from the sources, and checks its types and those of its use.
#   scripts/python_test.sh BUILD [pytest's arguments]
# PYTHON: for which Python (default: python3). Tools go into build/python.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
built=$(realpath "$1")
shift
python=${PYTHON:-python3}
installed=$PWD/build/python/installed
fresh=$(mktemp -d)
trap 'rm -rf "$fresh"' EXIT

cmake --build "$built" --target all_packaged
for component in program library development static; do
  cmake --install "$built" --prefix "$installed" --component $component >"$fresh/log"
done
tools=$(scripts/python_tools.sh)
PATH=$tools/bin:$PATH pip -q --disable-pip-version-check wheel . --no-deps \
  --no-build-isolation -w "$fresh/wheel" -C cmake.define.MENISCUS_INSTALLED="$installed"
ls -l "$fresh"/wheel/*.whl | awk '{n = split($9, path, "/"); print path[n] ": " $5 " bytes"}'

# The tools' packages, and of Meniscus the wheel alone.
"$python" -m venv "$fresh/venv"
"$fresh/venv/bin/pip" -q --disable-pip-version-check install --no-deps "$fresh"/wheel/*.whl
realpath "$tools"/lib/python*/site-packages >"$(echo "$fresh"/venv/lib/python*/site-packages)/tools.pth"
"$fresh/venv/bin/python" -m pytest -q -p no:cacheprovider "$@"
"$fresh/venv/bin/python" -m mypy --strict --cache-dir="$fresh/mypy" -p meniscus
"$fresh/venv/bin/python" -m mypy --strict --cache-dir="$fresh/mypy" python/tests/typed_use.py
