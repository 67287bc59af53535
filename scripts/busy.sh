#!/bin/sh
# The test suite RUNS times, each in another order, while LOAD processes keep every core busy:
#   sh scripts/busy.sh [RUNS] [LOAD] [SEED] [pytest's arguments]
# Ends at the first run that fails. What a test waits for must be an event, never a time.
set -eu
cd "$(dirname "$0")/.."
runs=${1:-5} load=${2:-4} seed=${3:-1}
shift "$(($# < 3 ? $# : 3))"
busy=""

quiet() {
    for process in $busy; do kill "$process" 2>/dev/null || true; done
}

trap quiet EXIT
trap 'exit 130' INT TERM
for _ in $(seq "$load"); do
    (while :; do :; done) &
    busy="$busy $!"
done
for run in $(seq "$runs"); do
    began=$(date +%s)
    .venv/bin/python -m pytest -n auto --maxprocesses 8 --dist loadfile -q \
        --randomly-seed="$((seed + run - 1))" "$@"
    echo "busy run $run of $runs, seed $((seed + run - 1)): passed in $(($(date +%s) - began)) s"
done
