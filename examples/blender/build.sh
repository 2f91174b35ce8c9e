#!/usr/bin/env bash
# Makes the extension that Blender installs: the add-on with the package meniscus for Blender's Python.
#   build.sh WHEEL OUT.zip
# WHEEL: meniscus_surface-*.whl of scripts/python_wheel.sh, for the Python of that Blender (5.0: 3.11).
set -euo pipefail
wheel=$(realpath "$1") out=$(realpath -m "$2")
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cp -r "$here/meniscus_cache" "$work/"
rm -rf "$work/meniscus_cache/__pycache__"
mkdir "$work/meniscus_cache/wheels"
cp "$wheel" "$work/meniscus_cache/wheels/"
sed -i "s|^wheels = .*|wheels = [\"./wheels/$(basename "$wheel")\"]|" "$work/meniscus_cache/blender_manifest.toml"
cd "$work/meniscus_cache"
python3 -c 'import shutil, sys; shutil.make_archive(sys.argv[1].removesuffix(".zip"), "zip", ".")' "$out"
echo "$out"
