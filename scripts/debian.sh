#!/usr/bin/env bash
# Builds Meniscus in a fresh Debian of another release, and verifies the OpenCL runtimes that the
# release has (PoCL and Mesa's rusticl). Needs root, and takes ten minutes on two cores.
#   scripts/debian.sh [RELEASE]    trixie (Debian 13) by default
# FOLDER is where its files go (default: build/RELEASE); TESTS=1 builds and runs the tests, too.
# Results are in FOLDER: verify of each runtime as .txt and .json, the build's words in build.txt.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
release=${1:-trixie}
folder=$(realpath -m "${FOLDER:-build/$release}")
((EUID == 0)) || { echo "debian: a system of its own can only be set up by root: sudo $0 $release" >&2; exit 1; }
command -v debootstrap >/dev/null || apt-get -qy install --no-install-recommends debootstrap
root=$folder/root
mkdir -p "$folder"

[[ -e $root/etc/debian_version ]] || debootstrap --variant=minbase "$release" "$root" >"$folder/debootstrap.txt"
rm -rf "$root/src"
git clone -q . "$root/src"

# In a mount namespace of its own, so that nothing of the host stays mounted below FOLDER.
inside() {
  unshare --mount bash -c '
    for system in proc sys dev; do mount --rbind "/$system" "$0/$system"; done
    exec chroot "$0" env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root "$@"' "$root" "$@"
}

inside bash -c 'cd /src && scripts/setup.sh && DEBIAN_FRONTEND=noninteractive apt-get -qy install --no-install-recommends mesa-opencl-icd' \
  >"$folder/packages.txt"
target=(--target meniscus_program)
[[ -z ${TESTS:-} ]] || target=()
inside bash -c 'cd /src && cmake --preset release && cmake --build --preset release "$@"' build "${target[@]}" >"$folder/build.txt" 2>&1 \
  || { tail -20 "$folder/build.txt" >&2; exit 1; }
echo "== $release: built, $(grep -c 'warning:' "$folder/build.txt" || true) warnings"

good=1
for runtime in pocl rusticl; do
  echo "== $runtime of $release"
  inside env OCL_ICD_VENDORS="/etc/OpenCL/vendors/$runtime.icd" RUSTICL_ENABLE=llvmpipe,swrast LP_CL=1 \
    /src/build/release/meniscus verify --timeout 900 --json "/tmp/$runtime.json" | tee "$folder/$runtime.txt" || good=0
  cp "$root/tmp/$runtime.json" "$folder/"
done
[[ -z ${TESTS:-} ]] || inside bash -c 'cd /src && OCL_ICD_VENDORS=/etc/OpenCL/vendors/pocl.icd ctest --preset release -j2 -LE long' || good=0
((good))
