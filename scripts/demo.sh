#!/usr/bin/env bash
# Installs what is missing, builds the command `meniscus extract`, and extracts the surface of a
# breaking dam. Says what it does, and after how many seconds it does it.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

say() { printf '[%3d s] %s\n' "$SECONDS" "$*"; }

say "1 of 4: installing the packages that are missing"
scripts/setup.sh
say "2 of 4: configuring"
# Without bench, tune, verify and MPI, which take most of the build; a folder that is there keeps what it has.
less=(-DMENISCUS_TOOLS=OFF -DMENISCUS_MPI=OFF)
[[ ! -e build/release/CMakeCache.txt ]] || less=()
log=$(cmake --preset release "${less[@]}" 2>&1) || {
  printf '%s\n' "$log" >&2
  exit 1
}
say "3 of 4: building with $(nproc) processors; a few minutes the first time"
cmake --build --preset release --target meniscus_program

out=build/demo
mkdir -p "$out"
say "4 of 4: extracting; the first start builds the kernels for this machine's device"
frame=(examples/data/dam/frame_015.ply --camera examples/data/dam/camera.json)
build/release/meniscus extract "${frame[@]}" -o "$out/dam.png" -o "$out/dam.exr" -o "$out/dam.ply"
build/release/meniscus extract -q "${frame[@]}" -o "$out/dam_normals.png" --preview normal

say "done"
cat <<END

The surface of the dam break is in
  $PWD/$out/dam.png          the picture
  $PWD/$out/dam_normals.png  its normals as colours
  $PWD/$out/dam.exr          depth, normals, positions, groups at every pixel
  $PWD/$out/dam.ply          the mesh
The program is $PWD/build/release/meniscus. 'cmake --preset release && cmake --build --preset release'
adds its commands bench, tune and verify, and the tests.
END
