"""What the sink's argument can mean, and what is not installed."""

from __future__ import annotations

import sys

import pytest

from tomoskin.core import SinkError, install_hint
from tomoskin.run.sinks import make_sink


@pytest.mark.parametrize(
    ("spec", "name"),
    [
        ("lsl", "lsl tomoskin"),
        ("lsl:left-hand", "lsl left-hand"),
    ],
)
def test_its_name_says_where_results_go(spec, name):
    assert make_sink(spec).name == name


@pytest.mark.parametrize(
    ("spec", "said"),
    [
        ("lsl:left hand", "letters and digits"),
    ],
)
def test_what_cannot_be_meant(spec, said):
    with pytest.raises(SinkError, match=said):
        make_sink(spec)


def test_a_missing_package_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "pylsl", None)
    with pytest.raises(SinkError) as raised:
        make_sink("lsl")
    assert raised.value.hint == install_hint("lsl")
