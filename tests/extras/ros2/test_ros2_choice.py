"""What the sink's argument can mean, and what is not installed."""

from __future__ import annotations

import sys

import pytest

from tomoskin.core import SinkError, install_hint
from tomoskin.run.sinks import make_sink


@pytest.mark.parametrize(
    ("spec", "name"),
    [
        ("ros2:domain=4", "ros2 /tomoskin, domain 4"),
        ("ros2:namespace=left_arm,domain=3", "ros2 /left_arm, domain 3"),
    ],
)
def test_its_name_says_where_results_go(spec, name):
    assert make_sink(spec).name == name


def test_a_missing_package_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "cyclonedds.core", None)
    with pytest.raises(SinkError) as raised:
        make_sink("ros2")
    assert raised.value.hint == install_hint("ros2")
