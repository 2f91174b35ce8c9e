# What .ci/run and .ci/nightly share: parts with their times, and lanes of parts that run side by side.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
TIMEFORMAT='== took %0R s, processor %0U s + %0S s of the system'
part() {
  echo "== $*"
  time "$@"
}

failed=0
logs=$(mktemp -d)
trap 'rm -rf "$logs"' EXIT
declare -A lanes
lane() {  # FUNCTION: runs it beside the others; what it says stands together
  "$@" >"$logs/$1" 2>&1 &
  lanes[$1]=$!
}
ended() {  # FUNCTION: waits for it and shows what it said
  local code=0
  wait "${lanes[$1]}" || code=$?
  cat "$logs/$1"
  ((code == 0)) || { echo "== FAILED with $code: $1"; failed=1; }
}
docs() {  # [DOCUMENT ...]
  part scripts/run_docs.py build/release "$@" || [[ $? == 3 ]] || failed=1  # 3: no overlay can be mounted here
}
