#!/bin/sh
# Sees to it that the MQTT sink's tests find a real broker, mosquitto.
set -eu
. "$(dirname "$0")/apt.sh"

ready() {
    command -v mosquitto >/dev/null || [ -x /usr/sbin/mosquitto ]
}

provide mosquitto "the MQTT sink's tests cannot run" mosquitto
