"""The sink ``foxglove``: a live server for Foxglove, in the schemas of our own session files."""

from __future__ import annotations

import contextlib
import os
import socket
import stat
import threading
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tomoskin.core import Event, SinkError, encode_json, needed
from tomoskin.files import messages
from tomoskin.files.session import schema_of
from tomoskin.run.sinks import Sink, port_of

DEFAULT_PORT = 8766
"""Foxglove's own default is the port of our page."""

_WHERE = "sink foxglove"
_TOPICS = ("/touches", "/scene", "/image", "/events")


@dataclass
class _Server:
    """A server, the context of its channels, and how many sinks use it."""

    context: Any
    server: Any
    users: int = 1


_robots: dict[tuple[str, int], _Server] = {}
_robots_lock = threading.Lock()
"""Foxglove shows one connection at a time: all skins of a robot are behind one port."""


class FoxgloveSink(Sink):
    """Serves ``ws://host:port`` by Foxglove's SDK; what nobody has subscribed to is not made."""

    naming = messages.Naming("")

    def __init__(self, host: str, port: int) -> None:
        self.name = f"foxglove at ws://{host}:{port}"
        self._address = host, port
        self._sdk = needed("foxglove", "foxglove", _WHERE, SinkError)
        self._server: _Server | None = None
        self._channels: dict[str, Any] = {}

    def open(self, stream: messages.Stream) -> None:
        """Begin to serve the channels of one skin."""
        sdk, self._stream = self._sdk, stream
        self._server = self._joined(stream)
        for topic in _TOPICS:
            ours = schema_of(topic)
            schema = sdk.Schema(name=ours.name, encoding=ours.encoding, data=ours.data)
            self._channels[topic] = sdk.Channel(
                stream.naming.namespace + topic,
                schema=schema,
                message_encoding="json",
                context=self._server.context,
            )

    def publish(self, item: messages.Item) -> None:
        """Send the messages of ``item``."""
        now = self._stream.log_time(messages.time_of(item))
        for event in (item,) if isinstance(item, Event) else item.events:
            self._send("/events", messages.log_message(event, now), now)
        if isinstance(item, Event):
            return
        if item.is_due:
            self._send("/touches", item.content(), now)
        self._show(item, now)

    def _show(self, contacts: messages.Contacts, now: int) -> None:
        """The touches in space, as often as the image, and where there are none for good."""
        pixels, image = self._stream.pixels, contacts.image
        if image is not None or contacts.voltages is None:
            self._send("/scene", messages.scene_message(contacts.touches, now), now)
        if image is not None and pixels is not None and self._channels["/image"].has_sinks():
            self._send("/image", messages.grid_message(image, pixels, contacts.host_time, now), now)

    def close(self) -> None:
        """Close the channels, and with the last skin the server."""
        server, self._server = self._server, None
        for channel in self._channels.values():
            channel.close()
        self._channels = {}
        if server is None:
            return
        with _robots_lock:
            server.users -= 1
            if server.users:
                return
            if _robots.get(self._address) is server:
                del _robots[self._address]
        server.server.stop()

    def _joined(self, stream: messages.Stream) -> _Server:
        """The server of the robot, or one of its own."""
        if stream.place is None:
            return self._begun(f"tomoskin, {stream.source}")
        with _robots_lock:
            server = _robots.get(self._address)
            if server is None:
                server = _robots[self._address] = self._begun("tomoskin, a robot's skins")
            else:
                server.users += 1
        return server

    def _begun(self, name: str) -> _Server:
        host, port = self._address
        # the SDK lets go of the channels too with the last reference to their context
        context = self._sdk.Context()
        try:
            server = self._sdk.start_server(name=name, context=context, host=host, port=port)
        except RuntimeError as error:
            raise SinkError(str(error), where=self.name, hint="choose another port") from error
        _send_at_once(port)
        return _Server(context, server)

    def _send(self, topic: str, content: Mapping[str, Any], now: int) -> None:
        channel = self._channels[topic]
        if channel.has_sinks():
            channel.log(encode_json(content), log_time=now)


def _send_at_once(port: int) -> None:
    """Let connections to a server of this process send each message when it is made.

    The SDK has no option for that, and as a rule a message waits until the one before it has been
    acknowledged, 40 ms. Connections have it from the socket that they come to.
    """
    with contextlib.suppress(OSError):  # a system that does not show what is open
        for number in [int(path.name) for path in Path("/dev/fd").iterdir()]:
            with contextlib.suppress(OSError):  # closed meanwhile
                if stat.S_ISSOCK(os.fstat(number).st_mode):
                    with socket.socket(fileno=os.dup(number)) as one:
                        if one.type == socket.SOCK_STREAM and one.getsockname()[1:2] == (port,):
                            one.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)


def open_foxglove(argument: str) -> FoxgloveSink:
    """``foxglove``, ``foxglove:8766``, ``foxglove:ADDRESS:8766``."""
    host, _, port = argument.rpartition(":")
    number = port_of(port, _WHERE) if port else DEFAULT_PORT
    return FoxgloveSink(host or "127.0.0.1", number)
