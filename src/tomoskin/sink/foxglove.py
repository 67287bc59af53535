"""The sink ``foxglove``: a live server for Foxglove, in the schemas of our own session files."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from tomoskin.core import Event, SinkError, encode_json
from tomoskin.recording import (
    grid_message,
    log_message,
    scene_message,
    schema_of,
    touches_message,
)
from tomoskin.sink.consumer import needed, port_of
from tomoskin.sink.sink import Item, Moment, Stream, TouchPace

DEFAULT_PORT = 8766
"""Foxglove's own default is the port of our page."""

_TOPICS = ("/touches", "/scene", "/image", "/events")


class FoxgloveSink:
    """Serves ``ws://host:port`` by Foxglove's SDK; what nobody has subscribed to is not made."""

    def __init__(self, host: str, port: int) -> None:
        self.name = f"foxglove at ws://{host}:{port}"
        self._address = {"host": host, "port": port}
        self._sdk = needed("foxglove", "foxglove")
        self._server: Any = None
        self._context: Any = None
        self._channels: dict[str, Any] = {}

    def open(self, stream: Stream) -> None:
        """Begin to serve."""
        sdk = self._sdk
        # kept: with its last reference the SDK lets go of the channels too
        self._context = context = sdk.Context()
        for topic in _TOPICS:
            found = schema_of(topic)
            schema = sdk.Schema(name=found.name, encoding=found.encoding, data=found.data)
            self._channels[topic] = sdk.Channel(
                topic, schema=schema, message_encoding="json", context=context
            )
        name = f"tomoskin, {stream.source}"
        try:
            self._server = sdk.start_server(name=name, context=context, **self._address)
        except RuntimeError as error:
            raise SinkError(str(error), where=self.name, hint="choose another port") from error
        self._stream, self._pace = stream, TouchPace()

    def publish(self, item: Item) -> None:
        """Send the messages of ``item``."""
        now = self._stream.log_time(item.host_time)
        for event in (item,) if isinstance(item, Event) else item.messages:
            self._send("/events", log_message(event, now), now)
        if isinstance(item, Event):
            return
        if self._pace.is_due(item):
            content = touches_message(item.host_time, item.sequence, item.touches)
            self._send("/touches", content, now)
        self._show(item, now)

    def _show(self, item: Moment, now: int) -> None:
        pixels = self._stream.pixels
        if item.image is None:
            return
        self._send("/scene", scene_message(item.touches, now, self._stream.surface), now)
        if pixels is not None and self._channels["/image"].has_sinks():
            self._send("/image", grid_message(item.image, pixels, item.host_time, now), now)

    def close(self) -> None:
        """Serve no longer."""
        server, self._server = self._server, None
        for channel in self._channels.values():
            channel.close()
        self._channels, self._context = {}, None
        if server is not None:
            server.stop()

    def _send(self, topic: str, content: Mapping[str, Any], now: int) -> None:
        channel = self._channels[topic]
        if channel.has_sinks():
            channel.log(encode_json(content), log_time=now)


def open_foxglove(argument: str) -> FoxgloveSink:
    """``foxglove``, ``foxglove:8766``, ``foxglove:ADDRESS:8766``."""
    host, _, port = argument.rpartition(":")
    number = port_of(port, "sink foxglove") if port else DEFAULT_PORT
    return FoxgloveSink(host or "127.0.0.1", number)
