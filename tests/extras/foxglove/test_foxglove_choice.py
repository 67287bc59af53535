"""What the sink's argument can mean, and what is not installed."""

from __future__ import annotations

import sys

import pytest

from tomoskin.core import SinkError, install_hint
from tomoskin.run.sinks import make_sink


@pytest.mark.parametrize(
    ("spec", "name"),
    [
        ("foxglove", "foxglove at ws://127.0.0.1:8766"),
        ("foxglove:9000", "foxglove at ws://127.0.0.1:9000"),
        ("foxglove:0.0.0.0:9000", "foxglove at ws://0.0.0.0:9000"),
    ],
)
def test_its_name_says_where_results_go(spec, name):
    assert make_sink(spec).name == name


@pytest.mark.parametrize(
    ("spec", "said"),
    [
        ("foxglove:port", "expected a port"),
        ("foxglove:70000", "expected a port"),
        ("foxglove:0", "expected a port"),
    ],
)
def test_what_cannot_be_meant(spec, said):
    with pytest.raises(SinkError, match=said):
        make_sink(spec)


def test_a_missing_package_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "foxglove", None)
    with pytest.raises(SinkError) as raised:
        make_sink("foxglove")
    assert raised.value.hint == install_hint("foxglove")
