"""Sinks by their names: what cannot be meant, and what is not installed."""

from __future__ import annotations

import sys

import pytest

from tomoskin.core import SinkError, install_hint
from tomoskin.run.sinks import make_sink, sink_names


def test_the_installed_sinks():
    assert {"foxglove", "lsl", "mqtt", "rerun", "ros2"} <= set(sink_names())


@pytest.mark.parametrize(
    ("spec", "name"),
    [
        ("foxglove", "foxglove at ws://127.0.0.1:8766"),
        ("foxglove:9000", "foxglove at ws://127.0.0.1:9000"),
        ("foxglove:0.0.0.0:9000", "foxglove at ws://0.0.0.0:9000"),
        ("mqtt://broker", "mqtt://broker:1883/tomoskin"),
        ("mqtt://me:secret@broker:99/robot/skin", "mqtt://broker:99/robot/skin"),
        ("mqtt://broker/robot/skin?frame=left_forearm", "mqtt://broker:1883/robot/skin"),
        ("lsl", "lsl tomoskin"),
        ("lsl:left-hand", "lsl left-hand"),
        ("ros2:domain=4", "ros2 /tomoskin, domain 4"),
        ("ros2:namespace=left_arm,domain=3", "ros2 /left_arm, domain 3"),
    ],
)
def test_names_say_where_results_go_but_no_password(spec, name):
    assert make_sink(spec).name == name


@pytest.mark.parametrize(
    ("spec", "said"),
    [
        ("", "expected a sink among"),
        ("kafka", f"among {', '.join(sink_names())}, got"),
        ("mqtl", 'did you mean "mqtt"'),
        ("foxglove:port", "expected a port"),
        ("foxglove:70000", "expected a port"),
        ("foxglove:0", "expected a port"),
        ("mqtt", "mqtt://HOST:PORT/TOPIC"),
        ("mqtt://", "mqtt://HOST:PORT/TOPIC"),
        ("mqtt://host/a/#", "mqtt://HOST:PORT/TOPIC"),
        ("mqtt://host:port/x", "Port could not"),
        ("mqtt://host:99999", "Port out of range"),
        ("lsl:left hand", "letters and digits"),
        ("mqtt://host/a?qos=1", "expected frame=…"),
        ("mqtt://host/a?frame=left arm", "expected a frame"),
    ],
)
def test_what_cannot_be_meant(spec, said):
    with pytest.raises(SinkError, match=said):
        make_sink(spec)


def test_a_password_is_never_said():
    for spec in ("mqtt://me:secret@host/a#b", "mqtt://me:12?secret@host/a"):
        with pytest.raises(SinkError) as raised:
            make_sink(spec)
        assert "secret" not in str(raised.value)


@pytest.mark.parametrize(
    ("spec", "module", "extra"),
    [
        ("foxglove", "foxglove", "foxglove"),
        ("mqtt://host", "paho.mqtt.client", "mqtt"),
        ("lsl", "pylsl", "lsl"),
        ("ros2", "cyclonedds.core", "ros2"),
    ],
)
def test_a_missing_extra_is_named(monkeypatch, spec, module, extra):
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(SinkError) as raised:
        make_sink(spec)
    assert raised.value.hint == install_hint(extra)
