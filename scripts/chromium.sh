#!/bin/sh
# Sees to it that the page tests find a Chromium and what Playwright's driver needs to run it: on
# Debian, as root, it installs them. Without them those tests are skipped, loudly; under CI=true
# that is a failure.
set -eu
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

if ready; then exit 0; fi
if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
    echo "set-up: installing chromium and libatomic1 with apt-get"
    { apt-get update && apt-get install -y --no-install-recommends chromium libatomic1; } \
        >/dev/null || true
    if ready; then exit 0; fi
fi
echo "set-up: no Chromium that Playwright can drive, so the page tests cannot run." >&2
echo "  On Debian: sudo apt-get install chromium libatomic1" >&2
if [ "${CI:-}" = true ]; then exit 1; fi
