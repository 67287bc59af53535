#!/bin/sh
# Installs the pinned packages of requirements file $2 for the Python $1: with uv, which takes a
# tenth of pip's time and which pip brings; where uv cannot (a mirror that only pip knows), with pip.
set -u
python=$1
wanted=$2
uv=$(dirname "$0")/../requirements/uv.txt

with_pip() {
    "$python" -m pip install --quiet --disable-pip-version-check --retries 2 \
        --require-hashes --only-binary :all: -r "$1"
}

with_uv() {
    "$python" -m uv --quiet pip install --python "$python" \
        --require-hashes --only-binary :all: -r "$1"
}

if "$python" -m uv --version >/dev/null 2>&1 || with_pip "$uv"; then
    if with_uv "$wanted" || with_pip "$wanted"; then exit 0; fi
fi
echo "set-up: the packages of $wanted could not be installed (see above): the first run needs the network." >&2
exit 1
