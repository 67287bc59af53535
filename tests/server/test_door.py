"""Connections that begin to ask and ask no further."""

import json
import socket
from contextlib import ExitStack

import pytest

from server.serving import PATIENCE, Site
from tomoskin.server import door


@pytest.fixture
def site(runner, tmp_path):
    (tmp_path / "index.html").write_text("<title>tomoskin</title>")
    runner.start()
    site = Site(runner, tmp_path)
    yield site
    site.stop()


HALF = b"GET /status HTTP/1.1\r\nHost: 127"


def half_open(site, stack):
    """A connection that begins to ask, and asks no further."""
    connection = socket.create_connection(("127.0.0.1", site.port), timeout=PATIENCE)
    stack.enter_context(connection).sendall(HALF)
    return connection


def closed(connection):
    """Whether the other side ends the connection, within the tests' patience."""
    try:
        return connection.recv(1) == b""
    except ConnectionResetError:
        return True


def test_half_a_request_has_an_end(site, monkeypatch, caplog):
    monkeypatch.setattr(door, "PATIENCE", 0.1)
    monkeypatch.setattr(door.Door, "_quiet_until", 0.0)
    with ExitStack() as stack:
        connections = [half_open(site, stack) for _ in range(3)]
        assert all(map(closed, connections))
    said = [record.message for record in caplog.records if "ask for nothing" in record.message]
    assert said == ["page: connections from 127.0.0.1 that ask for nothing are closed"]


def test_a_spare_connection_of_a_browser_is_closed_without_a_word(site, monkeypatch, caplog):
    monkeypatch.setattr(door, "PATIENCE", 0.1)
    monkeypatch.setattr(door.Door, "_quiet_until", 0.0)
    address = ("127.0.0.1", site.port)
    with socket.create_connection(address, timeout=PATIENCE) as spare:
        assert closed(spare)
    with socket.create_connection(address, timeout=PATIENCE) as kept:  # asked once, then kept
        kept.sendall(b"GET /status HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
        while kept.recv(4096):
            pass
    assert not [record for record in caplog.records if "ask for nothing" in record.message]


def test_half_requests_keep_nobody_out(site, monkeypatch, caplog):
    monkeypatch.setattr(door.Door, "_quiet_until", 0.0)
    with ExitStack() as stack:
        connections = [half_open(site, stack) for _ in range(door.MOST_WAITING + 20)]
        assert all(map(closed, connections[:20]))
        with site.client() as client:
            assert client.get("/status").status_code == 200
        page = stack.enter_context(site.connect())
        assert json.loads(page.recv(PATIENCE))
    assert len([r for r in caplog.records if "ask for nothing" in r.message]) == 1
