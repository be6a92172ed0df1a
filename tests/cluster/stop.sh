#!/usr/bin/env bash
# Ends the daemons that start.sh started, as root.
set -euo pipefail
[ "$(id -u)" -eq 0 ] || exec sudo "$0"

for daemon in $(tac /run/cluster_of_tests); do
    pid=$(cat "/run/$daemon.pid" 2>/dev/null) || continue
    kill "$pid" 2>/dev/null || continue
    for _ in $(seq 100); do
        kill -0 "$pid" 2>/dev/null || break
        sleep 0.1
    done
    if kill -0 "$pid" 2>/dev/null; then kill -9 "$pid"; fi
done
rm -f /run/cluster_of_tests
