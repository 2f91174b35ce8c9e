#!/usr/bin/env bash
# Installs OpenCL runtimes, each in an environment of its own, verifies every one of them and
# compares what they make of three real frames.
#   scripts/portability.sh [PROGRAM]
# RUNTIMES names those to try (default: all below), OPTIONS adds to those of verify, METHODS says which
# draw the frames, FOLDER where environments and results go (default: build/portability). Ends with the matrix: on the terminal, in FOLDER/matrix.md, and as a
# page, FOLDER/matrix.html. UPDATE=1 puts it into docs/portability_matrix.md, too.
# Exit code 0 when every runtime that could be installed passed and all hashes are the same.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
program=$(realpath "${1:-build/release/meniscus}")
folder=$(realpath -m "${FOLDER:-build/portability}")
runtimes=${RUNTIMES:-pocl pocl-pypi intel rusticl oclgrind nvidia}
mkdir -p "$folder"
[[ -x $program ]] || { echo "portability: $program is not there: build first (scripts/test.sh does)" >&2; exit 1; }

# Debian packages that are missing, as scripts/setup.sh does.
debian() {
  local missing=() package
  for package; do
    dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null | grep -q ^installed || missing+=("$package")
  done
  ((${#missing[@]})) || return 0
  local as_root=()
  ((EUID == 0)) || as_root=(sudo)
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -qy install --no-install-recommends "${missing[@]}" >"$folder/apt.log" 2>&1
}

# Python packages in a virtual environment of their own.
pypi() {
  local home=$folder/$1
  shift
  [[ -x $home/bin/pip ]] || python3 -m venv "$home" || { debian python3-venv && python3 -m venv "$home"; }
  "$home/bin/pip" -q --disable-pip-version-check install "$@"
}

# What a process needs in its environment to see one runtime only, and what it is started with.
# Installs it; fails where it cannot.
environment=() runner=()
prepare() {
  local library
  runner=()
  case $1 in
    pocl)
      debian pocl-opencl-icd || return 1
      library=/etc/OpenCL/vendors/pocl.icd ;;
    pocl-pypi)
      pypi "$1" pocl-binary-distribution || return 1
      library=$(find "$folder/$1/" -name 'libpocl-*.so' | head -1) ;;
    intel)
      pypi "$1" intel-opencl-rt intel-cmplr-lib-rt || return 1
      library=$(find "$folder/$1/" -name libintelocl.so | head -1) ;;
    rusticl)
      debian mesa-opencl-icd || return 1
      library=/etc/OpenCL/vendors/rusticl.icd ;;
    oclgrind)
      debian oclgrind || return 1
      library=$(find /usr/lib -name 'liboclgrind-rt-icd.so' | head -1) ;;
    nvidia)
      library=$(ldconfig -p | sed -n 's/.*=> \(.*libnvidia-opencl.so.1\)$/\1/p' | head -1) ;;
    *)
      echo "portability: there is no runtime $1 in this script" >&2
      return 1 ;;
  esac
  [[ -n $library && -e $library ]] || return 1
  mkdir -p "$folder/cache/$1"
  environment=(OCL_ICD_VENDORS="$library" POCL_CACHE_DIR="$folder/cache/$1")
  # Its LLVM 14 knows no newer processors and builds nothing on them. There it runs as on an older one.
  if [[ $1 == pocl-pypi ]] && env "${environment[@]}" "$program" devices | grep -q -- '-generic$'; then
    debian qemu-user || return 1
    runner=(qemu-x86_64 -cpu Haswell)
    environment+=(MENISCUS_LAUNCHER="${runner[*]}" MENISCUS_CACHE_DIR="$folder/cache/$1")
  fi
  [[ $1 != rusticl ]] || environment+=(LP_CL=1 RUSTICL_ENABLE="llvmpipe,swrast")
  [[ $1 != oclgrind ]] || environment+=(OCLGRIND_DATA_RACES=1 OCLGRIND_LOG="$folder/oclgrind.log")
}

frames=(
  "dam 015|examples/data/dam/frame_015.ply|examples/data/dam/camera.json"
  "cube 007|examples/data/cube_drop/frame_007.ply|examples/data/cube_drop/camera.json"
  "dam 0010|examples/data/dam_sequence/dam.0010.ply|examples/data/dam_sequence/camera.json")
methods=${METHODS:-fit stable paper ssm}

good=1
tried=()
: >"$folder/hashes.txt"
for runtime in $runtimes; do
  if ! prepare "$runtime"; then
    echo "== $runtime: cannot be installed here"
    continue
  fi
  echo "== $runtime"
  rm -f "$folder/$runtime.json" "$folder/oclgrind.log"
  options=(--timeout 900 ${OPTIONS:-})
  # A simulator takes its time.
  [[ $runtime != oclgrind ]] || options=(--size small --timeout 3600)
  env "${environment[@]}" "$program" verify --json "$folder/$runtime.json" "${options[@]}" \
    | tee "$folder/$runtime.txt" || good=0
  if [[ ! -s $folder/$runtime.json ]]; then
    echo "portability: verify ended on $runtime without results" >&2
    good=0
    continue
  fi
  tried+=("$runtime")
  if [[ $runtime == oclgrind ]]; then
    if [[ -s $folder/oclgrind.log ]]; then
      echo "oclgrind found faults; the first:"
      head -5 "$folder/oclgrind.log"
      good=0
    else
      echo "oclgrind: no race, no access out of bounds"
    fi
    continue  # real frames would take it days
  fi
  for frame in "${frames[@]}"; do
    IFS='|' read -r name input camera <<<"$frame"
    for method in $methods; do
      output=$folder/frame
      rm -f "$output".*
      env "${environment[@]}" "${runner[@]}" "$program" extract "$input" --camera "$camera" --method "$method" \
        --compression none -o "$output.exr" -o "$output.ply" -q >"$folder/extract.log" 2>&1 || true
      hash=failed
      [[ ! -e $output.ply ]] || hash=$(cat "$output.exr" "$output.ply" | md5sum | cut -c1-12)
      echo "$runtime|$name|$method|$hash" >>"$folder/hashes.txt"
    done
  done
  rm -f "$folder"/frame.*
done
((${#tried[@]})) || { echo "portability: no runtime could be tried" >&2; exit 1; }

jsons=()
for runtime in "${tried[@]}"; do jsons+=("$folder/$runtime.json"); done
((${#jsons[@]} < 2)) ||
  "$program" verify --compare "${jsons[@]}" --html "$folder/matrix.html" >"$folder/compare.txt" || good=0
python3 scripts/portability_matrix.py "$folder" "${tried[@]}" >"$folder/matrix.md" || good=0
echo
cat "$folder/matrix.md"
if [[ ${UPDATE:-} == 1 ]]; then
  python3 - "$folder/matrix.md" <<'PY'
import re, sys
matrix = open(sys.argv[1]).read()
page = open("docs/portability_matrix.md").read()
begin, end = "<!-- matrix -->\n", "<!-- end of the matrix -->"
page = re.sub(re.escape(begin) + ".*?" + re.escape(end), lambda _: begin + matrix + end, page, flags=re.S)
open("docs/portability_matrix.md", "w").write(page)
PY
fi
((good))
