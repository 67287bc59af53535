#!/bin/sh
# Sees to it that the tests of the board's circuit find ngspice.
set -eu
. "$(dirname "$0")/apt.sh"

ready() {
    command -v ngspice >/dev/null
}

provide ngspice "the board's circuit cannot be simulated" ngspice
