"""Sources by name."""

import pytest

from tomoskin.board.source import open_source, read_options, source_names, transport
from tomoskin.core import Registered, SourceError


def echo(argument, skin):
    return argument, skin


@pytest.fixture(autouse=True)
def installed(monkeypatch):
    known = {name: Registered(name, f"{__name__}:echo") for name in ("twin", "serial")}
    monkeypatch.setattr(transport, "registered", lambda _: known)
    monkeypatch.setattr(transport, "registered_one", lambda _, name: known.get(name))
    monkeypatch.setattr(Registered, "load", lambda _: echo)


def test_names_and_arguments():
    assert source_names() == ("serial", "twin")
    assert open_source("twin", "skin") == ("", "skin")
    assert open_source("twin:seed=3", "skin") == ("seed=3", "skin")
    assert open_source("serial:/dev/tty:1", "skin") == ("/dev/tty:1", "skin")


def test_an_unknown_source_is_refused_with_those_known():
    with pytest.raises(SourceError, match=r"expected a source among serial, twin, got \"usb\""):
        open_source("usb:1", None)


def test_options():
    assert read_options("", ("a",), "x") == {}
    assert read_options("seed=3, fast", ("seed", "fast"), "x") == {"seed": "3", "fast": ""}
    with pytest.raises(SourceError, match='x: expected an option among seed, fast, got "slow"'):
        read_options("slow", ("seed", "fast"), "x")
