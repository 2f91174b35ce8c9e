#!/usr/bin/env bash
# Tries submit.sh on this machine as a Slurm cluster of two nodes, one of which dies on the way.
#   scripts/slurm/test.sh PROGRAM FRAME.ply... [FRAMES=320]
# The frames are taken again and again until there are FRAMES: the tasks must outlive the ten seconds
# after which the dead node's are requeued. What ran on it goes on for a while as an orphan.
# Needs slurm-wlm and munge (Debian 12) and root, no systemd; nothing stays behind. Every frame must
# come out with the bytes of an undisturbed run, and the report job must run at the end.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
program=$(realpath "$1")
shift
frames=320 inputs=()
for word in "$@"; do
  [[ $word == FRAMES=* ]] && frames=${word#FRAMES=} || inputs+=("$(realpath "$word")")
done
work=$(mktemp -d)
fail() {
  echo "slurm test: $*" >&2
  tail -n 5 "$work"/log/*.log "$work"/*.out >&2 || true
  exit 1
}
# The processes of this cluster, orphans too: those that inherited its configuration, by their ids.
of_cluster() (
  unset SLURM_CONF
  grep -lzxF "SLURM_CONF=$work/slurm.conf" /proc/[0-9]*/environ 2>/dev/null | cut -d/ -f3 || true
)
stop_cluster() {
  scancel --user=root 2>/dev/null || true
  for signal in TERM KILL; do
    for pid in $(of_cluster); do kill -"$signal" "$pid" 2>/dev/null || true; done
    sleep 1
  done
  rm -rf "$work"
}
trap stop_cluster EXIT

start_cluster() {
  mkdir -p "$work"/{state,spool/n1,spool/n2,run,log}
  install -d -o munge -g munge -m 755 /run/munge
  install -d -o munge -g munge -m 700 /var/log/munge /var/lib/munge
  munge -n >/dev/null 2>&1 || { rm -f /run/munge/*; runuser -u munge -- /usr/sbin/munged; }
  cat >"$work/slurm.conf" <<CONF
ClusterName=meniscus
SlurmctldHost=localhost
SlurmUser=root
AuthType=auth/munge
SlurmctldPort=16817
StateSaveLocation=$work/state
SlurmdSpoolDir=$work/spool/%n
SlurmctldPidFile=$work/run/ctld.pid
SlurmdPidFile=$work/run/slurmd.%n.pid
SlurmctldLogFile=$work/log/ctld.log
SlurmdLogFile=$work/log/slurmd.%n.log
MailProg=/bin/true
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
SchedulerType=sched/builtin
SchedulerParameters=sched_interval=1,batch_sched_delay=0,sched_min_interval=0
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SlurmdParameters=config_overrides
SlurmdTimeout=10
KillWait=5
ReturnToService=2
NodeName=n1 NodeHostname=localhost NodeAddr=127.0.0.1 Port=16818 CPUs=2 RealMemory=4000
NodeName=n2 NodeHostname=localhost NodeAddr=127.0.0.1 Port=16819 CPUs=2 RealMemory=4000
PartitionName=main Nodes=n1,n2 Default=YES MaxTime=INFINITE State=UP
CONF
  export SLURM_CONF=$work/slurm.conf
  slurmctld
  slurmd -N n1
  slurmd -N n2
  for _ in $(seq 60); do
    [[ $(sinfo -h -t idle -o %D) == 2 ]] && return
    sleep .5
  done
  fail "the cluster did not come up"
}

mkdir "$work/cache" "$work/whole" "$work/out"
for ((k = 0; k < frames; ++k)); do
  ln -s "${inputs[k % ${#inputs[@]}]}" "$work/cache/$(printf 'f.%04d.ply' "$k")"
done
input="$work/cache/f.####.ply"
outputs() { echo -o "$1/f.####.exr" -o "$1/f.####.ply"; }
"$program" extract "$input" $(outputs "$work/whole") -q

start_cluster
cd "$work"
export MENISCUS=$program
read -r array report < <("$here/submit.sh" 4 logs --chdir="$work" -- "$input" \
  $(outputs "$work/out") --threads 1)
echo "array $array, report $report: $frames frames in 4 tasks on two nodes"

# The second node dies when its task is under way.
for _ in $(seq 600); do
  task=$(squeue -h -t RUNNING -w n2 -o %K | head -1)
  [[ -n $task && -s logs/$task.jsonl ]] && break
  sleep .2
done
[[ -n ${task:-} ]] || fail "no task ran on the second node"
kill -KILL "$(cat run/slurmd.n2.pid)"
echo "killed the second node in task $task after $(wc -l <"logs/$task.jsonl") of its frames"

for _ in $(seq 1200); do
  [[ -z $(squeue -h) ]] && break
  sleep .5
done
[[ -z $(squeue -h) ]] || fail "jobs are left: $(squeue -h)"
grep -q "requeue\|Requeue" log/ctld.log || fail "no task was requeued"
frames_under_way() {
  for pid in $(of_cluster); do
    [[ $(readlink "/proc/$pid/exe" 2>/dev/null) == "$program" ]] && return
  done
  return 1
}
for _ in $(seq 100); do frames_under_way || break; sleep .2; done

diff -rq whole out || fail "the outputs differ from an undisturbed run"
(($(find out -name '.*' -type f | wc -l) == 0)) || fail "temporary files are left"
[[ -s logs/report.html ]] || fail "there is no report"
done_frames=$(cat logs/*.jsonl | grep -c '"status":"done"')
echo "$frames frames, all right; $done_frames were done in all, $((done_frames - frames)) of them twice"
echo "report: $(wc -c <logs/report.html) bytes"
