"""What the sink's argument can mean, and what is not installed."""

from __future__ import annotations

import sys

import pytest

from tomoskin.core import SinkError, install_hint
from tomoskin.run.sinks import example_of, make_sink


@pytest.mark.parametrize(
    ("spec", "name"),
    [
        ("mqtt://broker", "mqtt://broker:1883/tomoskin"),
        ("mqtt://me:secret@broker:99/robot/skin", "mqtt://broker:99/robot/skin"),
        ("mqtt://broker/robot/skin?frame=left_forearm", "mqtt://broker:1883/robot/skin"),
    ],
)
def test_its_name_says_where_results_go_but_no_password(spec, name):
    assert make_sink(spec).name == name


@pytest.mark.parametrize(
    ("spec", "said"),
    [
        ("mqtt", "mqtt://HOST:PORT/TOPIC"),
        ("mqtt://", "mqtt://HOST:PORT/TOPIC"),
        ("mqtt://host/a/#", "mqtt://HOST:PORT/TOPIC"),
        ("mqtt://host:port/x", "Port could not"),
        ("mqtt://host:99999", "Port out of range"),
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


def test_the_doctor_can_try_it():
    assert make_sink(example_of("mqtt")).name == "mqtt://127.0.0.1:1883/tomoskin"


def test_a_missing_package_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "paho.mqtt.client", None)
    with pytest.raises(SinkError) as raised:
        make_sink("mqtt://host")
    assert raised.value.hint == install_hint("mqtt")
