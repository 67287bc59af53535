#!/bin/sh
# Sees to it that the tests of the board's circuit find ngspice: on Debian, as root, it installs it.
# Without it those tests are skipped, loudly; under CI=true that is a failure.
set -eu

ready() {
    command -v ngspice >/dev/null
}

if ready; then exit 0; fi
if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
    echo "set-up: installing ngspice with apt-get"
    { apt-get update && apt-get install -y --no-install-recommends ngspice; } >/dev/null || true
    if ready; then exit 0; fi
fi
echo "set-up: no ngspice, so the board's circuit cannot be simulated." >&2
echo "  On Debian: sudo apt-get install ngspice" >&2
if [ "${CI:-}" = true ]; then exit 1; fi
