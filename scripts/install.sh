#!/bin/sh
# Installs the pinned packages of requirements file $2 for the Python $1: with uv, which takes a
# tenth of pip's time; where uv cannot (a mirror that only pip is told of), with pip.
set -u

pip_install() {
    "$1" -m pip install --quiet --disable-pip-version-check --require-hashes --only-binary :all: -r "$2"
}

here=$(dirname "$0")
if ! "$1" -m uv --version >/dev/null 2>&1; then
    pip_install "$1" "$here/../requirements/uv.txt"
fi
if "$1" -m uv --quiet pip install --python "$1" --require-hashes --only-binary :all: -r "$2" ||
    pip_install "$1" "$2"; then
    exit 0
fi
echo "set-up: the packages of $2 could not be installed (see above)." >&2
echo "  The first run needs the network; a mirror of the package index is named as pip is told it." >&2
exit 1
