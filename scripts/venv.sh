#!/bin/sh
# Makes the virtual environment in $1 with the first Python that will do: $PYTHON, else python3,
# else a newer one beside it. On Debian, as root, it installs what is missing.
set -eu

venv=$1

will_do() {
    "$1" -c 'import ensurepip, sys, venv; sys.exit(sys.version_info < (3, 11))' >/dev/null 2>&1
}

find_python() {
    for python in ${PYTHON:-python3 python3.11 python3.12 python3.13 python3.14 /usr/bin/python3}; do
        if will_do "$python"; then
            echo "$python"
            return
        fi
    done
    return 1
}

if [ -x "$venv/bin/python" ] && "$venv/bin/python" -m pip --version >/dev/null 2>&1; then
    exit 0
fi
if ! python=$(find_python); then
    if [ -z "${PYTHON:-}" ] && [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
        echo "set-up: installing python3-venv with apt-get"
        { apt-get update && apt-get install -y --no-install-recommends python3 python3-venv; } \
            >/dev/null || true
    fi
    python=$(find_python) || {
        echo "set-up: needs Python 3.11 or newer with its venv module${PYTHON:+, and PYTHON=$PYTHON is none}." >&2
        echo "  On Debian: sudo apt-get install python3 python3-venv; elsewhere: make PYTHON=/path/to/python3" >&2
        exit 1
    }
fi
echo "set-up: $venv with $("$python" --version)"
rm -rf "$venv"
"$python" -m venv "$venv"
