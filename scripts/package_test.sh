#!/usr/bin/env bash
# Makes the Debian packages and the source archive and looks at them.
#   scripts/package_test.sh BUILD [--chroot [SUITE]]
# --chroot: installs the packages in a bare Debian system of its own (debootstrap, as root; SUITE:
# bookworm), runs the program there, reads its manual, and builds a consumer with pkg-config and with
# CMake. MIRROR: of Debian (http://deb.debian.org/debian).
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
build=$(realpath "$1") chroot=${2:-} suite=${3:-bookworm}
[[ -z $chroot || $chroot == --chroot ]] || { echo "package_test: what is $chroot?" >&2; exit 2; }
version=$("$build/meniscus" --version | cut -d' ' -f2)
work=$(mktemp -d)
trap 'rm -rf --one-file-system "$work"' EXIT
fail() { echo "package_test: $*" >&2; exit 1; }

cmake --build "$build" --target all_packaged >"$work/log" 2>&1 || { cat "$work/log" >&2; exit 1; }
(cd "$work" && cpack --config "$build/CPackConfig.cmake" >"$work/log" 2>&1) || { cat "$work/log" >&2; exit 1; }
debs=("$work"/*.deb)
for deb in "${debs[@]}"; do
  echo "$(basename "$deb"): $(stat -c %s "$deb") bytes; depends on $(dpkg-deb -f "$deb" Depends)"
  dpkg-deb -x "$deb" "$work/all"
done
while read -r file; do compgen -G "$work/all/$file" >/dev/null || fail "the packages lack $file"; done <<END
usr/bin/meniscus
usr/share/man/man1/meniscus.1
usr/share/man/man1/meniscus-extract.1
usr/share/bash-completion/completions/meniscus
usr/share/zsh/vendor-completions/_meniscus
usr/share/fish/vendor_completions.d/meniscus.fish
usr/include/meniscus/meniscus.hpp
usr/lib/libmeniscus.so
END
! grep -rIl -e "$PWD" -e "$build" "$work/all" || fail "these files hold a path of this machine"
for page in "$work"/all/usr/share/man/man1/*; do
  complaints=$(LC_ALL=C.UTF-8 MANROFFSEQ='' man --warnings -E UTF-8 -l -Tutf8 -Z "$page" 2>&1 >/dev/null) || true
  [[ -z $complaints ]] || fail "$(basename "$page"): $complaints"
done

# The source archive has all that a build takes, and needs no git.
(cd "$work" && cpack --config "$build/CPackSourceConfig.cmake" >"$work/log" 2>&1) || { cat "$work/log" >&2; exit 1; }
tar -xzf "$work/meniscus-$version.tar.gz" -C "$work"
if command -v git >/dev/null && git rev-parse --is-inside-work-tree >/dev/null 2>&1; then
  git ls-files ':!.ci' ':!.[a-z]*' | while read -r file; do
    [[ ! -e $file || -e $work/meniscus-$version/$file ]] || fail "the source archive lacks $file"
  done
fi
cmake -S "$work/meniscus-$version" -B "$work/configured" -G Ninja >"$work/log" 2>&1 ||
  { cat "$work/log" >&2; fail "the source archive cannot be configured"; }
echo "meniscus-$version.tar.gz: $(stat -c %s "$work/meniscus-$version.tar.gz") bytes"
[[ -n $chroot ]] || exit 0

root=$work/root
debootstrap --variant=minbase "$suite" "$root" "${MIRROR:-http://deb.debian.org/debian}" >"$work/log" 2>&1 ||
  { tail -5 "$work/log" >&2; fail "debootstrap failed"; }
# With /proc, /sys and /dev, which PoCL looks at, in a name space whose mounts go with it.
inside() {
  unshare --mount sh -c 'mount -t proc proc "$0/proc" && mount --rbind /sys "$0/sys" && mount --rbind /dev "$0/dev" &&
    exec chroot "$0" env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LC_ALL=C.UTF-8 DEBIAN_FRONTEND=noninteractive "$@"' \
    "$root" "$@"
}
# As apt is told here, where it is told anything.
cp -r /etc/apt/apt.conf.d/. "$root/etc/apt/apt.conf.d/" 2>/dev/null || true
cp /etc/resolv.conf "$root/etc/" 2>/dev/null || true
mkdir "$root/packages"
rm -f "$root/etc/dpkg/dpkg.cfg.d/"*exclude*
cp "${debs[@]}" "$root/packages/"
cp -r examples "$root/examples"
cat >"$root/test.sh" <<END
set -ex
apt-get -q update
apt-get -qy install --no-install-recommends /packages/meniscus_*.deb man-db
meniscus --version
meniscus devices
meniscus extract /examples/data/dam/frame_015.ply --camera /examples/data/dam/camera.json -q -o /dam.png -o /dam.ply
man meniscus | cat
man meniscus-extract | head -40
apt-get -qy install --no-install-recommends /packages/*.deb g++ cmake ninja-build pkgconf
g++ -std=c++20 /examples/from_memory.cpp -o /by_pkg_config \$(pkg-config --cflags --libs meniscus)
cd /root && /by_pkg_config
cmake -S /examples -B /by_cmake -G Ninja -DCMAKE_BUILD_TYPE=Release
cmake --build /by_cmake
/by_cmake/extract_surface /examples/data/cube_drop/frame_007.ply
ldd /by_pkg_config | grep libmeniscus
apt-get -qy purge 'libmeniscus*' 'meniscus*'
[ ! -e /usr/bin/meniscus ]
END
inside bash /test.sh >"$work/chroot.log" 2>&1 || { tail -60 "$work/chroot.log" >&2; fail "failed in the bare $suite"; }
cp "$work/chroot.log" "$build/chroot.log"
cmp "$root/dam.ply" <("$build/meniscus" extract examples/data/dam/frame_015.ply --camera examples/data/dam/camera.json -q -o "$work/here.ply" && cat "$work/here.ply") ||
  fail "the packaged program makes another mesh"
echo "in a bare $suite: installed, ran, read, built with pkg-config and with CMake, removed ($build/chroot.log)"
