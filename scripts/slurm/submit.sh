#!/usr/bin/env bash
# Shares a sequence between the tasks of a Slurm array, and makes one report when all are over.
#   scripts/slurm/submit.sh TASKS LOGS [SBATCH OPTIONS] -- ARGUMENTS OF meniscus extract
# e.g.
#   scripts/slurm/submit.sh 8 logs --time=2:00:00 -- 'cache/dam.####.ply' -o 'out/dam.####.exr' \
#     --camera camera.json
# LOGS gets a log for each task and report.html. The program is $MENISCUS, else meniscus on the path.
# Submitting the same again does what is missing. Prints the ids of the array and the report job.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)

usage() {
  sed -n '2,/^set/{/^#/s/^# \{0,1\}//p}' "${BASH_SOURCE[0]}" >&2
  exit 2
}
(($# >= 3)) && [[ $1 =~ ^[1-9][0-9]*$ ]] || usage
tasks=$1 logs=$2
shift 2
options=()
while (($#)) && [[ $1 != -- ]]; do options+=("$1") && shift; done
(($# > 1)) || usage
shift

mkdir -p "$logs"
export MENISCUS_LOGS=$(cd "$logs" && pwd)
array=$(sbatch --parsable --array="1-$tasks" "${options[@]}" "$here/frames.sbatch" "$@")
report=$(sbatch --parsable --dependency="afterany:$array" "$here/report.sbatch")
echo "$array $report"
