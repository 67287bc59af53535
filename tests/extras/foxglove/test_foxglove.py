"""The Foxglove server, met by a client that speaks its protocol (foxglove.sdk.v1).

https://docs.foxglove.dev/docs/connecting-to-data/frameworks/custom describes it: the server
advertises channels as JSON, a client subscribes, and each message is an opcode (1), the
subscription (u32), the log time in ns (u64) and the payload.
"""

from __future__ import annotations

import json
import os
import socket
import stat
import struct
import time
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import pytest
from websockets.sync.client import connect

from files.session.runs import FOLD, TOUCH
from run.sinks.conftest import EPOCH, EVENT, PATIENCE, begin, contacts_at, free_port, stream
from tomoskin.core import SinkError
from tomoskin.files.session import schema_of
from tomoskin.run.sinks import make_sink

__all__ = ["stream"]

OPEN = Path("/dev/fd")
_MESSAGE = struct.Struct("<BIQ")


@pytest.fixture
def served(stream):
    port = free_port()
    sink = make_sink(f"foxglove:{port}")
    begin(sink, stream)
    yield sink, port
    sink.close()


class Client:
    """Subscribes to every channel under its own number."""

    def __init__(self, connection):
        self._connection = connection
        self.info = self._told("serverInfo")
        self.channels = {c["topic"]: c for c in self._told("advertise")["channels"]}
        wanted = [{"id": c["id"], "channelId": c["id"]} for c in self.channels.values()]
        connection.send(json.dumps({"op": "subscribe", "subscriptions": wanted}))
        self._topics = {c["id"]: topic for topic, c in self.channels.items()}

    def _told(self, op):
        while True:
            message = self._connection.recv(PATIENCE)
            if isinstance(message, str) and (found := json.loads(message))["op"] == op:
                return found

    def message(self):
        """(topic, ns, content) of the next one."""
        while True:
            data = self._connection.recv(PATIENCE)
            if isinstance(data, bytes) and data[0] == 1:
                _, number, time = _MESSAGE.unpack_from(data)
                return self._topics[number], time, json.loads(data[_MESSAGE.size :])


def connected(port):
    return connect(f"ws://127.0.0.1:{port}", subprotocols=["foxglove.sdk.v1"], proxy=None)


def subscribed(sink, client):
    """Publish an event once the client is heard: subscribing takes effect a little later."""
    deadline = time.monotonic() + PATIENCE
    while not all(channel.has_sinks() for channel in sink._channels.values()):
        assert time.monotonic() < deadline
    sink.publish(EVENT)
    return client.message()


def test_what_a_client_sees(served):
    sink, port = served
    with connected(port) as connection:
        client = Client(connection)
        assert "twin of textile-disc-8" in client.info["name"]
        for topic, channel in client.channels.items():
            schema = schema_of(topic)
            assert (channel["encoding"], channel["schemaName"]) == ("json", schema.name)
            assert channel["schema"] == schema.data.decode()
        topic, time, content = subscribed(sink, client)
        assert (topic, time) == ("/events", round((EPOCH + 0.5) * 1e9))
        assert content["message"] == EVENT.text
        sink.publish(replace(contacts_at(1.0, TOUCH, sequence=3), deformation=FOLD))
        found = {topic: content for topic, _, content in (client.message() for _ in "abc")}
    assert found["/touches"]["sequence"] == 3
    assert found["/touches"]["touches"][0]["x"] == TOUCH.detection.x
    assert found["/touches"]["touches"][0]["position"] == [TOUCH.detection.x, TOUCH.detection.y, 0]
    assert found["/touches"]["valid"]
    assert found["/touches"]["deformation"]["axis"] == {"value": 0.5, "low": 0.4, "high": 0.6}
    assert found["/scene"]["entities"][0]["id"] == "touch-4"
    assert found["/image"]["column_count"] == 48


@pytest.mark.skipif(not OPEN.is_dir(), reason="the system does not show what is open")
def test_no_message_waits_until_the_one_before_is_acknowledged(served):
    _, port = served
    told = []
    with connected(port) as connection:
        Client(connection)
        for number in [int(path.name) for path in OPEN.iterdir()]:
            with suppress(OSError):
                if stat.S_ISSOCK(os.fstat(number).st_mode):
                    with socket.socket(fileno=os.dup(number)) as one:
                        if one.getsockname()[1:2] == (port,) and one.getpeername():
                            told.append(one.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY))
    assert told
    assert all(told)


def test_a_port_in_use_is_said_and_a_closed_server_leaves_it(served, stream):
    sink, port = served
    second = make_sink(f"foxglove:{port}")
    with pytest.raises(SinkError, match=r"in use.*choose another port"):
        begin(second, stream)
    second.close()
    sink.close()
    deadline = time.monotonic() + PATIENCE
    while not served_by(second, stream):  # its listener ends a little later
        assert time.monotonic() < deadline
    second.close()


def served_by(sink, stream):
    try:
        begin(sink, stream)
    except SinkError:
        sink.close()
        return False
    return True
