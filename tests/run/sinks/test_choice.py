"""Sinks by their names."""

from __future__ import annotations

import pytest

from tomoskin.core import Registered, SinkError
from tomoskin.run.sinks import Sink, example_of, make_sink, sink, tried_with


class Plain(Sink):
    """A sink that drops all."""

    def __init__(self, argument):
        self.name = f"plain {argument}"

    def publish(self, item):
        del item


@tried_with("here")
def open_plain(argument):
    if not argument:
        raise SinkError("expected where to, got none")
    return Plain(argument)


@pytest.fixture(autouse=True)
def known(monkeypatch):
    """One sink that needs an argument, and one that cannot be loaded."""
    entries = {"plain": "open_plain", "gone": "none"}
    table = {n: Registered(n, f"run.sinks.test_choice:{t}") for n, t in entries.items()}
    monkeypatch.setattr(Registered, "load", lambda self: globals()[self.target.partition(":")[2]])
    monkeypatch.setattr(sink, "registered", lambda _: table)
    monkeypatch.setattr(sink, "registered_one", lambda _, name: table.get(name))


@pytest.mark.parametrize(
    ("spec", "said"),
    [
        ("", "expected a sink among gone, plain, got"),
        ("kafka", "expected a sink among gone, plain, got"),
        ("plane", 'did you mean "plain"'),
        ("plain", "expected where to"),
        ("gone:x", "cannot be made: KeyError"),
    ],
)
def test_what_cannot_be_meant(spec, said):
    with pytest.raises(SinkError, match=said):
        make_sink(spec)


def test_a_sink_says_with_what_it_can_be_tried():
    assert make_sink(example_of("plain")).name == "plain here"
    assert example_of("gone") == "gone"
