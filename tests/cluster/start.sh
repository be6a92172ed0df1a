#!/usr/bin/env bash
# Makes this machine a SLURM cluster of one node, without systemd and without accounting, as root.
# For the tests of this folder, on a machine to spare: it replaces /etc/slurm/slurm.conf. `stop.sh` ends
# the daemons that were started, whose names are kept in /run/cluster_of_tests.
set -euo pipefail
[ "$(id -u)" -eq 0 ] || exec sudo "$0"

node=$(hostname -s)
cores=$(nproc --all) # without it OMP_NUM_THREADS is the answer, which is 1 under the tests
memory=$(awk '/MemTotal/ { print int($2 / 1024 * 0.9) }' /proc/meminfo)

install -d -m 755 /etc/slurm /var/spool/slurmctld /var/spool/slurmd
install -d -m 711 -o munge /etc/munge /var/lib/munge /var/log/munge
install -d -m 755 -o munge /run/munge
if [ ! -s /etc/munge/munge.key ]; then
    (umask 077 && head -c 1024 /dev/urandom >/etc/munge/munge.key)
    chown munge /etc/munge/munge.key
fi

cat >/etc/slurm/slurm.conf <<EOF
ClusterName=one
SlurmctldHost=$node(127.0.0.1)
SlurmUser=root
AuthType=auth/munge
StateSaveLocation=/var/spool/slurmctld
SlurmdSpoolDir=/var/spool/slurmd
SlurmctldPidFile=/run/slurmctld.pid
SlurmdPidFile=/run/slurmd.pid
SlurmctldLogFile=/var/log/slurmctld.log
SlurmdLogFile=/var/log/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core_Memory
MpiDefault=none
MinJobAge=600
ReturnToService=0
SchedulerParameters=batch_sched_delay=0,sched_interval=2
NodeName=$node NodeAddr=127.0.0.1 CPUs=$cores RealMemory=$memory State=UNKNOWN
PartitionName=all Nodes=$node Default=YES MaxTime=INFINITE State=UP OverSubscribe=NO
EOF

runs() { [ -s "$1" ] && kill -0 "$(cat "$1" 2>/dev/null)" 2>/dev/null; }

: >/run/cluster_of_tests
if ! runs /run/munge/munged.pid; then
    runuser -u munge -- munged
    echo munge/munged >>/run/cluster_of_tests
fi
for daemon in slurmctld slurmd; do
    if runs "/run/$daemon.pid"; then
        kill "$(cat "/run/$daemon.pid")"
        while runs "/run/$daemon.pid"; do sleep 0.1; done
    fi
    "$daemon" -c
    echo "$daemon" >>/run/cluster_of_tests
done
for _ in $(seq 100); do
    if sinfo --noheader --states=idle --format=%n 2>/dev/null | grep -qx "$node"; then exit 0; fi
    sleep 0.1
done
sinfo >&2
exit 1
