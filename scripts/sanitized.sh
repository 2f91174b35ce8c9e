#!/usr/bin/env bash
# Builds with the address and undefined behaviour sanitizers, and runs the tests that are labelled
# fast, which read and write every kind of file, and the program: a frame, a batch, its report.
# Every test has one try. Preset asan, without optimization, which halves its build, and without
# bench, tune and verify.
#   scripts/sanitized.sh
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
build=$PWD/build/asan
cmake --preset asan -DCMAKE_CXX_FLAGS_SANITIZE=-O0 -DMENISCUS_TOOLS=OFF
cmake --build --preset asan --target \
  meniscus_program library_test application_test io_test host_rounding meniscus_fuzz
# Left out: large files, which only take longer than small ones, and scripts that check sources.
ctest --preset asan -j2 -L fast \
  -E '^(ExrReader.ReadsALarge|ContactSheet.ManyPicturesThatPackBadly|Docs|Scripts)'

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
export LSAN_OPTIONS=suppressions=$PWD/tests/lsan.supp:print_suppressions=0
run() {
  echo "meniscus $*"
  "$build/meniscus" "$@"
}
cp examples/data/dam_sequence/dam.000[89].ply "$work"
cd "$work"
run extract dam.0008.ply --size 96x72 -q -o f.exr -o f.png -o f.ply -o f.obj
run extract 'dam.####.ply' --method ssm --size 96x72 -q --log log.jsonl -o 's.####.exr'
run extract 'dam.####.ply' --method ssm --size 96x72 -q --log log.jsonl -o 's.####.exr' --resume
run report log.jsonl -q -o report.html
