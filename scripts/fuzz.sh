#!/usr/bin/env bash
# Fuzzes all that reads files: particles, cameras, pictures, logs, results; each for a share of the
# time, from the kept corpus in tests/fuzz/corpus.
#   scripts/fuzz.sh BUILD [SECONDS [FOUND [ENTRY ...]]]
# BUILD is a build of preset asan; SECONDS in all, default 60; what is found goes into the folder
# FOUND: ENTRY/ inputs that reach new code, and crash-*, timeout-* or oom-* beside them, which end
# the run with 1. No input may take 10 s, 2 GB, or 400 MB at once. An entry without a kept corpus (vdb,
# in a build with OpenVDB) starts from the files in FOUND/ENTRY.
set -euo pipefail
fuzz=$(realpath "$1")/tests/fuzz/meniscus_fuzz
cd "$(dirname "${BASH_SOURCE[0]}")/.."
seconds=${2:-60} found=${3:-}
entries=("${@:4}")
((${#entries[@]})) || mapfile -t entries < <(ls tests/fuzz/corpus)
if [[ -z $found ]]; then
  found=$(mktemp -d)
  trap 'rm -rf "$found"' EXIT
fi

failed=()
for entry in "${entries[@]}"; do
  mkdir -p "$found/$entry"
  kept=(tests/fuzz/corpus/"$entry")
  [[ -d ${kept[0]} ]] || kept=()
  # Larger files than those of the corpus, too: 1 MB of those that are read fastest.
  case $entry in ply | rows | xyz | csv | vtk | vtp | bgeo | lammps) longest=1048576 ;; *) longest=65536 ;; esac
  "$fuzz" --entry="$entry" -max_total_time=$(((seconds + ${#entries[@]} - 1) / ${#entries[@]})) \
    -max_len=$longest -timeout=10 -rss_limit_mb=2048 -malloc_limit_mb=400 -print_final_stats=1 \
    -artifact_prefix="$found/$entry-" "$found/$entry" "${kept[@]}" \
    >"$found/$entry.log" 2>&1 || failed+=("$entry")
  awk -v entry="$entry" '/INITED/ { begin = $4 } /cov:/ { for (k = 1; k < NF; ++k) if ($k == "cov:") end = $(k + 1) }
    /number_of_executed_units/ { runs = $2 }
    END { printf "%-8s %9d executions, coverage %d -> %d\n", entry, runs, begin, end }' "$found/$entry.log"
done
((${#failed[@]} == 0)) && exit 0
for entry in "${failed[@]}"; do
  echo "fuzz: $entry: $(grep -m1 -E 'ERROR|fuzz:|error:' "$found/$entry.log" || true)"
  tail -40 "$found/$entry.log"
  for input in "$found/$entry"-*; do
    [[ -f $input && $(stat -c %s "$input") -le 3000 ]] && { echo "$input:"; base64 "$input"; }
  done
done
exit 1
