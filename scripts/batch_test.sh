#!/usr/bin/env bash
# Kills a batch at random moments and resumes it, stops it gently, and fills its disk.
#   scripts/batch_test.sh PROGRAM 'INPUT.####.ply' CAMERA [KILLS]
# After every kill all files under final names are compared with those of an undisturbed run, and at
# the end all of them. The full disk is a small tmpfs where this may be mounted (root), else it is
# left out.
set -euo pipefail
program=$(realpath "$1") input=$2 camera=$(realpath "$3") kills=${4:-50}
work=$(mktemp -d)
mounted=
trap '[[ -z $mounted ]] || umount "$mounted"; rm -rf "$work"' EXIT
fail() { echo "batch_test: $*" >&2; exit 1; }

# The command for a folder, not a function: a function in the background is another process.
command_for() {
  extract=("$program" extract "$input" -o "$1/f.####.exr" -o "$1/f.####.png" -o "$1/f.####.ply"
    --camera "$camera" -q)
}
left_overs() { find "$1" -name '.*' -type f | wc -l; }

mkdir "$work/whole" "$work/killed" "$work/stopped"
command_for "$work/whole"
"${extract[@]}"  # builds the kernels
begin=$(date +%s%N)
"${extract[@]}"
took=$((($(date +%s%N) - begin) / 1000000))
files=$(ls "$work/whole" | wc -l)
echo "undisturbed: $files files in $took ms"

hit=0
command_for "$work/killed"
for ((k = 1; k <= kills; ++k)); do
  "${extract[@]}" --resume &
  process=$!
  sleep "$(awk -v ms=$((RANDOM * 32768 + RANDOM)) -v all="$took" 'BEGIN { print (ms % all) / 1000 }')"
  kill -KILL $process 2>/dev/null || true
  code=0
  wait $process 2>/dev/null || code=$?
  ((code != 137)) || hit=$((hit + 1))  # else it had ended, and nothing was killed
  for file in "$work"/killed/*; do
    [[ -e $file ]] || continue
    cmp -s "$file" "$work/whole/$(basename "$file")" || fail "kill $k: $(basename "$file") differs"
  done
  # When most is done there is nothing left to disturb.
  (($(ls "$work/killed" | wc -l) < files * 3 / 4)) || rm -f "$work"/killed/*
done
"${extract[@]}" --resume
diff -rq "$work/whole" "$work/killed" || fail "after $kills kills the outputs differ"
((3 * hit >= kills)) || fail "only $hit of $kills runs were killed: give more or larger frames"
(($(left_overs "$work/killed") == 0)) || fail "temporary files are left after the last run"
echo "killed $hit of $kills times: every output equal, nothing left over"

command_for "$work/stopped"
"${extract[@]}" &
process=$!
sleep "$(awk -v all="$took" 'BEGIN { print all / 2000 }')"
kill -TERM $process
code=0
wait $process || code=$?
((code == 143)) || fail "SIGTERM: exit code $code, wanted 143"
(($(left_overs "$work/stopped") == 0)) || fail "SIGTERM left temporary files"
there=$(ls "$work/stopped" | wc -l)
((there % 3 == 0)) || fail "SIGTERM left a frame with some of its files"
"${extract[@]}" --resume
diff -rq "$work/whole" "$work/stopped" || fail "after SIGTERM the outputs differ"
echo "SIGTERM: exit code 143 with $there of $files files, nothing left over; resumed: equal"

mkdir "$work/disk"
if mount -t tmpfs -o size=$(($(du -sk "$work/whole" | cut -f1) / 2))k tmpfs "$work/disk" 2>/dev/null; then
  mounted=$work/disk
  code=0
  command_for "$work/disk"
  "${extract[@]}" 2>"$work/message" || code=$?
  ((code == 1)) || fail "full disk: exit code $code, wanted 1"
  (($(grep -c 'meniscus: error:' "$work/message") == 1)) || fail "full disk: $(cat "$work/message")"
  (($(left_overs "$work/disk") == 0)) || fail "the full disk has temporary files"
  (($(ls "$work/disk" | wc -l) % 3 == 0)) || fail "the full disk has parts of frames"
  for file in "$work"/disk/*; do
    cmp -s "$file" "$work/whole/$(basename "$file")" || fail "full disk: $(basename "$file") differs"
  done
  echo "full disk: $(ls "$work/disk" | wc -l) of $files files, all whole; said: $(tail -1 "$work/message")"
else
  echo "full disk: not tried, no tmpfs can be mounted here"
fi
