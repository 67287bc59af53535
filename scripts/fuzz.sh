#!/bin/sh
# Mutated streams through both parsers: scripts/fuzz.sh PYTHON [HOST_STREAMS [BOARD_STREAMS [SEED]]]
set -eu
here=$(dirname "$0")
host=${2:-8500000} board=${3:-1500000} seed=${4:-1}
make --silent -C "$here/../firmware" fuzz RUNS="$board" SEED="$seed"
echo "board parser: $board mutated streams (seed $seed), no fault found"
"$1" "$here/../tests/wire/streams.py" "$host" "$seed"
