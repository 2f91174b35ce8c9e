#!/usr/bin/env bash
# Installs splashsurf (pysplashsurf on PyPI) in a folder of its own and prints the program's path.
#   benchmarks/peers/splashsurf.sh [FOLDER]      the folder is build/peers unless given
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
folder=${1:-build/peers}
program=$folder/bin/pysplashsurf

if [[ ! -x $program ]]; then
  if ! python3 -m venv "$folder" >&2; then
    echo "splashsurf.sh: python3 with venv is needed (Debian: python3-venv)" >&2
    exit 1
  fi
  "$folder/bin/pip" install --quiet 'pysplashsurf==0.14.1.0' >&2
fi
realpath -s "$program"
