#!/bin/sh
# Sees to it that the page tests find a Chromium: on Debian, as root, it installs one. Without one
# those tests are skipped, loudly; under CI=true that is a failure.
set -eu

for name in chromium chromium-browser google-chrome; do
    if command -v "$name" >/dev/null; then exit 0; fi
done
if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
    echo "set-up: installing chromium with apt-get"
    if { apt-get update && apt-get install -y --no-install-recommends chromium; } >/dev/null; then
        exit 0
    fi
fi
echo "set-up: no Chromium, so the page tests cannot run." >&2
echo "  On Debian: sudo apt-get install chromium" >&2
if [ "${CI:-}" = true ]; then exit 1; fi
