#!/bin/sh
# Mutated streams through the parsers and the Pico's USB part:
# scripts/fuzz.sh PYTHON [HOST_STREAMS [BOARD_STREAMS [SEED [USB_HOSTS]]]]
set -eu
here=$(dirname "$0")
host=${2:-8500000} board=${3:-1500000} seed=${4:-1} usb=${5:-500000}
make --silent -C "$here/../firmware" fuzz RUNS="$board" SEED="$seed"
echo "board parser: $board mutated streams (seed $seed), no fault found"
make --silent -C "$here/../firmware" fuzz-usb RUNS="$usb" SEED="$seed"
echo "USB part of the Pico: $usb mutated hosts (seed $seed), no fault found"
"$1" "$here/../tests/board/wire/streams.py" "$host" "$seed"
