#!/bin/sh
# Sees to it that the MQTT sink's tests find a real broker, mosquitto: on Debian, as root, it installs
# it. Without it those tests are skipped, loudly; under CI=true that is a failure.
set -eu

ready() {
    command -v mosquitto >/dev/null || [ -x /usr/sbin/mosquitto ]
}

if ready; then exit 0; fi
if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
    echo "set-up: installing mosquitto with apt-get"
    { apt-get update && apt-get install -y --no-install-recommends mosquitto; } >/dev/null || true
    if ready; then exit 0; fi
fi
echo "set-up: no mosquitto, so the MQTT sink's tests cannot run." >&2
echo "  On Debian: sudo apt-get install mosquitto" >&2
if [ "${CI:-}" = true ]; then exit 1; fi
