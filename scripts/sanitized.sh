#!/usr/bin/env bash
# Builds with the address and undefined behaviour sanitizers, and runs the tests that are labelled
# fast, those of what verify reads and writes, and the program: a frame, a batch, its report,
# comparisons. Every test has one try. Preset asan, without optimization, which halves its build.
#   scripts/sanitized.sh
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
build=$PWD/build/asan
cmake --preset asan -DCMAKE_CXX_FLAGS_SANITIZE=-O0
cmake --build --preset asan --target \
  meniscus_program library_test application_test io_test verify_test meniscus_fuzz
ctest --preset asan -j2 -L fast
ctest --preset asan -j2 -R '^(VerifyRun|VerifyRow|CanonicalFile|ArgumentNames)\.'

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
export LSAN_OPTIONS=suppressions=$PWD/tests/lsan.supp:print_suppressions=0
run() {
  echo "meniscus $*"
  "$build/meniscus" "$@"
}
cp examples/data/dam_sequence/dam.000[89].ply "$work"
corpus=$PWD/tests/fuzz/corpus
cd "$work"
run extract dam.0008.ply --size 96x72 -q -o f.exr -o f.png -o f.ply -o f.obj
run extract 'dam.####.ply' --method ssm --size 96x72 -q --log log.jsonl -o 's.####.exr'
run extract 'dam.####.ply' --method ssm --size 96x72 -q --log log.jsonl -o 's.####.exr' --resume
run report log.jsonl -q -o report.html
run verify --compare "$corpus/verify/one.json" "$corpus/verify/two.json" --html verify.html \
  --junit verify.xml >verify.txt || (($? == 1))  # 1: they differ
