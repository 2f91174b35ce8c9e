#!/usr/bin/env bash
# Builds the program that makes meshes with OpenVDB and prints its path. Needs OpenVDB's headers
# (Debian: libopenvdb-dev).
#   benchmarks/peers/openvdb.sh [FOLDER]         the folder is build/peers unless given
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
folder=${1:-build/peers}
program=$folder/openvdb_mesh source=benchmarks/peers/openvdb_mesh.cpp

if [[ ! -x $program || $source -nt $program ]]; then
  if [[ ! -e /usr/include/openvdb/openvdb.h ]]; then
    echo "openvdb.sh: OpenVDB's headers are needed (Debian: libopenvdb-dev)" >&2
    exit 1
  fi
  mkdir -p "$folder"
  ${CXX:-g++} -O3 -march=native -std=c++17 -w "$source" -o "$program" -lopenvdb -ltbb -lImath >&2
fi
realpath -s "$program"
