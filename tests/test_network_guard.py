"""The guard of conftest.py: loopback is reached, anything else is refused."""

from __future__ import annotations

import socket

import pytest


def test_loopback_is_reached() -> None:
    with (
        socket.create_server(("127.0.0.1", 0)) as server,
        socket.create_connection(server.getsockname()) as client,
    ):
        assert client.getpeername() == server.getsockname()


@pytest.mark.parametrize("address", [("192.0.2.1", 9), ("example.invalid", 80)])
@pytest.mark.parametrize("method", ["connect", "connect_ex"])
def test_other_machines_are_refused(method: str, address: tuple[str, int]) -> None:
    with socket.socket() as client, pytest.raises(RuntimeError, match="loopback only"):
        getattr(client, method)(address)


def test_datagrams_are_refused_too() -> None:
    with (
        socket.socket(type=socket.SOCK_DGRAM) as sender,
        pytest.raises(RuntimeError, match="loopback only"),
    ):
        sender.sendto(b"x", ("192.0.2.1", 9))
