#!/usr/bin/env bash
# Shares a sequence between the tasks of a Slurm array, and makes one report when all are over.
#   scripts/slurm/submit.sh TASKS LOGS [SBATCH OPTIONS] -- [extract|mesh] ARGUMENTS
# e.g.
#   scripts/slurm/submit.sh 8 logs --time=2:00:00 -- 'cache/dam.####.ply' -o 'out/dam.####.exr' \
#     --camera camera.json
# The arguments are those of meniscus extract, or after the word mesh those of meniscus mesh. LOGS
# gets a log for each task and report.html. The program is $MENISCUS, else meniscus on the path.
# Submitting the same again does what is missing. The report's job gets those of the sbatch options
# that say who pays and where: account, partition, qos, reservation, clusters, chdir. Prints the ids
# of the array and of the report's job.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)

usage() {
  sed -n '2,/^set/{/^#/s/^# \{0,1\}//p}' "${BASH_SOURCE[0]}" >&2
  exit 2
}
(($# >= 3)) && [[ $1 =~ ^[1-9][0-9]*$ ]] || usage
tasks=$1 logs=$2
shift 2
options=() shared=()
while (($#)) && [[ $1 != -- ]]; do
  options+=("$1")
  case $1 in
    --account=* | --partition=* | --qos=* | --reservation=* | --clusters=* | --chdir=* | -[ApqMD]?*)
      shared+=("$1") ;;
    --account | --partition | --qos | --reservation | --clusters | --chdir | -[ApqMD])
      (($# > 1)) || usage
      options+=("$2") shared+=("$1" "$2")
      shift ;;
  esac
  shift
done
(($# > 1)) || usage
shift

mkdir -p "$logs"
export MENISCUS_LOGS=$(cd "$logs" && pwd)
# Where --clusters is given, sbatch prints the cluster's name after the id.
array=$(sbatch --parsable --array="1-$tasks" "${options[@]}" "$here/frames.sbatch" "$@")
array=${array%%;*}
if ! report=$(sbatch --parsable --dependency="afterany:$array" "${shared[@]}" \
  "$here/report.sbatch"); then
  echo "$array"
  echo "submit.sh: array $array is submitted, but the job of its report was refused. Run it later:" >&2
  echo "  meniscus report $MENISCUS_LOGS/*.jsonl -o $MENISCUS_LOGS/report.html" >&2
  exit 1
fi
echo "$array ${report%%;*}"
