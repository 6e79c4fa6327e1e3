#!/usr/bin/env bash
# A Slurm cluster of this machine alone, to try a sweep on: experiments/sweep/one_node_slurm.sh start|stop|conf, as root.
# `start` installs what is missing of Debian's packages, writes a slurm.conf for this host into the folder
# $HERMESH_SLURM (default: hermesh-slurm in the folder for temporary files), starts munged, slurmctld and slurmd without
# systemd, and waits until the node is idle; clients need `export SLURM_CONF=$(experiments/sweep/one_node_slurm.sh conf)`.
# `stop` ends these three and no others. Nothing outside that folder is written, so that a cluster that is there already
# stays as it is.
set -euo pipefail
[ $# = 1 ] || { sed -n '2,7s/^# //p' "$0"; exit 2; }
here=$(cd "$(dirname "$0")" && pwd)
folder=${HERMESH_SLURM:-${TMPDIR:-/tmp}/hermesh-slurm}
conf=$folder/slurm.conf

# Ends the daemon of a pid file, and waits for it, the hard way after ten seconds.
end() {
  local pid
  pid=$(cat "$1" 2>/dev/null) || return 0
  kill "$pid" 2>/dev/null || return 0
  for _ in $(seq 100); do
    kill -0 "$pid" 2>/dev/null || return 0
    sleep 0.1
  done
  kill -9 "$pid" 2>/dev/null || true
}

stop() {
  end "$folder/slurmd.pid"
  end "$folder/slurmctld.pid"
  end "$folder/munged.pid"
}

write_conf() {
  local cores memory
  cores=$(nproc)
  # A job may ask for what the machine has, a tenth left aside.
  memory=$(awk '/^MemTotal/ { print int($2 / 1024 * 0.9) }' /proc/meminfo)
  cat >"$conf" <<CONF
ClusterName=hermesh
SlurmctldHost=$(hostname -s)(127.0.0.1)
SlurmUser=root
AuthType=auth/munge
AuthInfo=socket=$folder/munge.socket
SlurmctldPort=${HERMESH_SLURM_PORT:-16817}
SlurmdPort=$((${HERMESH_SLURM_PORT:-16817} + 1))
StateSaveLocation=$folder/state
SlurmdSpoolDir=$folder/spool
SlurmctldPidFile=$folder/slurmctld.pid
SlurmdPidFile=$folder/slurmd.pid
SlurmctldLogFile=$folder/slurmctld.log
SlurmdLogFile=$folder/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU_Memory
DefMemPerCPU=512
SlurmdParameters=config_overrides
SchedulerParameters=sched_interval=5
ReturnToService=2
KillWait=3
NodeName=$(hostname -s) NodeAddr=127.0.0.1 CPUs=$cores RealMemory=$memory State=UNKNOWN
PartitionName=sweep Nodes=$(hostname -s) Default=YES MaxTime=INFINITE State=UP
CONF
}

start() {
  source "$here/../install_packages.sh"
  install_packages "${slurm_packages[@]}" "${sweep_packages[@]}"
  if [ -e "$conf" ] && SLURM_CONF=$conf scontrol ping >/dev/null 2>&1; then
    echo "it runs already: $conf"
    return
  fi
  rm -rf "$folder"
  mkdir -p "$folder/state" "$folder/spool"
  # munged insists that nobody else can write into the folders of its files.
  chmod 755 "$folder"
  write_conf
  head -c 1024 /dev/urandom >"$folder/munge.key"
  chmod 600 "$folder/munge.key"
  munged --force --socket="$folder/munge.socket" --key-file="$folder/munge.key" --pid-file="$folder/munged.pid" \
    --log-file="$folder/munged.log" --seed-file="$folder/munged.seed"
  slurmctld -f "$conf"
  slurmd -f "$conf"
  local state=
  for _ in $(seq 60); do
    state=$(SLURM_CONF=$conf sinfo --noheader --format=%T 2>/dev/null) || true
    [ "$state" = idle ] && break
    sleep 0.5
  done
  if [ "$state" != idle ]; then
    tail -n 20 "$folder"/*.log >&2
    echo "The node did not become idle but is '$state'; the lines above may say why." >&2
    stop
    exit 1
  fi
  SLURM_CONF=$conf sinfo --Node --long
}

case $1 in
  start) start ;;
  stop) stop ;;
  conf) echo "$conf" ;;
  *) sed -n '2,7s/^# //p' "$0"; exit 2 ;;
esac
