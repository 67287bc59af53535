#!/bin/sh
# Sees to it that the page tests find a Chromium and what Playwright's driver needs to run it.
set -eu
. "$(dirname "$0")/apt.sh"
python=$(dirname "$0")/../.venv/bin/python

has_chromium() {
    command -v chromium || command -v chromium-browser || command -v google-chrome
}

driver_runs() {
    "$("$python" -c 'import importlib.util as u; print(u.find_spec("playwright").submodule_search_locations[0])')/driver/node" --version
}

ready() {
    { has_chromium && driver_runs; } >/dev/null 2>&1
}

provide "Chromium that Playwright can drive" "the page tests cannot run" chromium libatomic1
