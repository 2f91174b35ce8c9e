#!/usr/bin/env bash
# Lets each OpenCL call of one extraction fail, in a run of the program of its own.
#   scripts/failing_calls.sh BUILD [STEP]
# BUILD is the build folder; every STEP-th call, default all. Each run must end with exit code 1, one
# line of error that names the call, and no file; or, where the program rightly goes on, with 0 and
# the same bytes. The error is CL_INVALID_OPERATION, after which a frame is not extracted again.
set -euo pipefail
build=$(realpath "$1") step=${2:-1}
program=$build/meniscus shim=$build/tests/libfailing_call.so
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
fail() { echo "failing_calls: $*" >&2; exit 1; }

# What the program calls and the shim does not know would never fail.
known=$(nm -D --defined-only "$shim" | sed -n 's/.* T \(cl[A-Z][A-Za-z]*\)$/\1/p')
for call in $(nm -D --undefined-only "$program" | sed -n 's/.* \(cl[A-Z][A-Za-z]*\).*/\1/p'); do
  case $call in clRelease* | clRetain*) continue ;; esac
  grep -qx "$call" <<<"$known" || fail "$call is not among the calls that can be made to fail"
done

awk 'BEGIN {
  print "ply\nformat ascii 1.0\ncomment particle_radius 0.5\nelement vertex 72"
  print "property float x\nproperty float y\nproperty float z"
  print "property float vx\nproperty float vy\nproperty float vz\nend_header"
  for (k = 0; k < 2; ++k) for (j = 0; j < 6; ++j) for (i = 0; i < 6; ++i)
    print i + .11 * sin(3 * i + 7 * j + k), j + .13 * cos(5 * i + j - k), .2 * sin(i + 2 * j) - k, 0, 1, .5
}' >"$work/in.ply"
mkdir "$work/whole" "$work/out"
extract() {  # FOLDER
  "$program" extract "$work/in.ply" --eye 9,10,11 --target 2.5,2.5,-0.5 --size 24x17 --timings \
    -o "$1/f.exr" -o "$1/f.ply" >"$work/said" 2>&1
}
extract "$work/whole"  # builds the kernels
LD_PRELOAD=$shim MENISCUS_COUNT_CALLS=$work/calls extract "$work/whole"
mapfile -t calls <"$work/calls"

errors=0 unmoved=0 wrong=0
for ((n = 1; n <= ${#calls[@]}; n += step)); do
  call=${calls[n - 1]} code=0
  LD_PRELOAD=$shim MENISCUS_FAIL_CALL=$n MENISCUS_FAIL_CODE=-59 extract "$work/out" || code=$?
  lines=$(grep -c '^meniscus: error: ' "$work/said" || true)
  if ((code == 0)); then
    unmoved=$((unmoved + 1))
    diff -rq "$work/whole" "$work/out" >/dev/null && ((lines == 0)) && { rm -f "$work"/out/*; continue; }
    what="exit code 0, but other files"
  else
    errors=$((errors + 1))
    ((code == 1 && lines == 1)) && [[ -z $(ls -A "$work/out") ]] && grep -q "$call" "$work/said" && continue
    what="exit code $code, $lines lines of error, files: $(ls -A "$work/out" | xargs)"
  fi
  wrong=$((wrong + 1))
  echo "call $n, $call: $what: $(tail -1 "$work/said")"
  find "$work/out" -mindepth 1 -delete
done
echo "${#calls[@]} calls, every $step. tried: $errors errors, $unmoved without effect, $wrong wrong"
((wrong == 0))
