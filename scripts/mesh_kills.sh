#!/usr/bin/env bash
# Kills `meniscus mesh --adaptive` at random moments and, every second time, as soon as it has begun to
# write: a sequence, which is resumed, and one frame that is made in parts, which is made again.
#   scripts/mesh_kills.sh PROGRAM [KILLS]
# After every kill what lies under final names is compared with an undisturbed run's, and at the end all.
set -euo pipefail
program=$(realpath "$1") kills=${2:-20}
data=$(realpath "$(dirname "${BASH_SOURCE[0]}")/../examples/data/dam_sequence")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
fail() { echo "mesh_kills: $*" >&2; exit 1; }

"$program" generate --particles 3e5 -o "$work/large.ply" -q
mkdir "$work"/{sequence,parts}_{whole,killed}
# The command for a kind and a folder, not a function: a function in the background is another process.
command_for() {
  case $1 in
    sequence) words=("$program" mesh "$data/dam.####.ply" -o "$2/f.####.ply" --adaptive 0.05 -q --resume) ;;
    parts) words=("$program" mesh "$work/large.ply" -o "$2/f.ply" --adaptive 0.05 --memory 30M -q) ;;
  esac
}
for kind in sequence parts; do
  whole=$work/${kind}_whole killed=$work/${kind}_killed
  command_for $kind "$whole"
  "${words[@]}"  # builds the kernels
  rm "$whole"/*
  begin=$(date +%s%N)
  "${words[@]}"
  took=$((($(date +%s%N) - begin) / 1000000))
  command_for $kind "$killed"
  hit=0
  for ((k = 1; k <= kills; ++k)); do
    "${words[@]}" &
    process=$!
    if ((k % 2)); then
      sleep "$(awk -v ms=$((RANDOM * 32768 + RANDOM)) -v all="$took" 'BEGIN { print (ms % all) / 1000 }')"
    else  # while it writes
      until compgen -G "$killed/.[!.]*" >/dev/null || ! kill -0 $process 2>/dev/null; do :; done
    fi
    kill -KILL $process 2>/dev/null || true
    code=0
    wait $process 2>/dev/null || code=$?
    ((code != 137)) || hit=$((hit + 1))
    for file in "$killed"/*; do
      [[ ! -e $file ]] || cmp -s "$file" "$whole/$(basename "$file")" || fail "$kind, kill $k: $file differs"
    done
    (($(ls "$killed" | wc -l) < 4)) || rm -f "$killed"/*
  done
  "${words[@]}"
  # Only --resume takes temporary files of killed runs away, and only sequences have it.
  command_for sequence "$killed"
  "${words[@]}"
  (($(find "$killed" -name '.*' -type f | wc -l) == 0)) || fail "$kind: temporary files are left"
  [[ $kind == sequence ]] || rm "$killed"/f.0*.ply
  diff -rq "$whole" "$killed" || fail "$kind: after $kills kills the meshes differ"
  echo "$kind: killed $hit of $kills times, half of them while writing, and all meshes are equal"
done
