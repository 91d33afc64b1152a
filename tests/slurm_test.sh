#!/bin/sh
# SPDX-License-Identifier: MIT
# tests/slurm_test.sh RILL WORK: a Slurm cluster of one node (munged, slurmctld, slurmd, all private to WORK) runs
# content/slurm/cook.sh on the liquid in content/; the asset must be the bytes that one machine makes. Exit code 77: skipped.
set -eu
rill=$1
work=$2
here=$(cd "$(dirname "$0")" && pwd)
for program in slurmctld slurmd munged sbatch mungekey; do
    PATH=$PATH:/usr/sbin command -v "$program" >/dev/null || {
        echo "skipped: no $program here (third_party/install.sh slurm)"
        exit 77
    }
done
[ "$(id -u)" -eq 0 ] || { echo "skipped: a Slurm node is started as root only"; exit 77; }
PATH=$PATH:/usr/sbin

rm -rf "$work"
mkdir -p -m 755 "$work/state" "$work/spool"
work=$(cd "$work" && pwd)
# A socket's path must be short.
sockets=$(mktemp -d /tmp/rill_slurm_XXXXXX)
chmod 755 "$sockets"
started=
stop() {
    for pid in $started; do kill "$pid" 2>/dev/null || true; done
    wait
    rm -rf "$sockets"
}
trap stop EXIT
trap 'exit 1' INT TERM

start() {  # NAME COMMAND...: in the background, ended with the test
    name=$1
    shift
    "$@" >"$work/$name.out" 2>&1 &
    started="$! $started"
}
mungekey --create --keyfile="$sockets/key"
start munged munged --foreground --force --key-file="$sockets/key" --socket="$sockets/munge" --pid-file="$sockets/munged.pid" \
    --log-file="$work/munged.log" --seed-file="$sockets/seed"
host=$(hostname -s)
port=$((20000 + $$ % 20000))
cat >"$work/slurm.conf" <<END
ClusterName=rill
SlurmctldHost=$host(127.0.0.1)
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket=$sockets/munge
CredType=cred/munge
SlurmctldPort=$port
SlurmdPort=$((port + 1))
SlurmctldPidFile=$work/slurmctld.pid
SlurmdPidFile=$work/slurmd.pid
StateSaveLocation=$work/state
SlurmdSpoolDir=$work/spool
SlurmctldLogFile=$work/slurmctld.log
SlurmdLogFile=$work/slurmd.log
ProctrackType=proctrack/pgid
TaskPlugin=task/none
SwitchType=switch/none
MpiDefault=none
ReturnToService=2
SchedulerParameters=sched_min_interval=100000,batch_sched_delay=0,sched_interval=1
NodeName=$host NodeAddr=127.0.0.1 CPUs=$(nproc) State=UNKNOWN
PartitionName=all Nodes=$host Default=YES State=UP MaxTime=INFINITE
END
export SLURM_CONF="$work/slurm.conf"
start slurmctld slurmctld -D -i -f "$work/slurm.conf"
start slurmd slurmd -D -N "$host" -f "$work/slurm.conf"

ready=
for _ in $(seq 60); do
    if sinfo --noheader -o %t 2>/dev/null | grep -q '^idle'; then ready=yes && break; fi
    sleep 1
done
if [ -z "$ready" ]; then
    tail -n 5 "$work"/*.log "$work"/*.out
    echo "skipped: Slurm's daemons do not run in this environment"
    exit 77
fi

input=$here/../content/drop_splash
set -- --frames 1:13 --error 1e --window 1
"$rill" cook "$input" -o "$work/alone.rill" "$@" --quiet || [ $? -eq 3 ]
cd "$work"
RILL="$rill" SEGMENTS=3 sh "$here/../content/slurm/cook.sh" "$input" "$work/farm.rill" "$@"
# Until nothing is left, or only what can never start.
while squeue --noheader -o %r | grep -qv DependencyNeverSatisfied; do sleep 1; done
cmp "$work/alone.rill" "$work/farm.rill" || {
    cat "$work"/*.log | tail -n 40
    exit 1
}
[ ! -e "$work/farm.rill.parts" ] || { echo "parts were left behind"; exit 1; }
echo "three segments on a Slurm node, linked: the bytes of one machine"
