"""The sink ``mqtt``: touches and events as JSON, for a broker."""

from __future__ import annotations

import threading
from dataclasses import replace
from typing import Any
from urllib.parse import SplitResult, unquote, urlsplit

from tomoskin.core import Event, SinkError, encode_json, needed
from tomoskin.files.messages import Item, Naming, Stream, event_content
from tomoskin.run.sinks.sink import Sink, options_of

DEFAULT_PORT = 1883

PERIOD = 0.05
"""Seconds between two messages of touches that go on; beginnings and ends are sent at once."""

_WHERE = "sink mqtt"
_PATIENCE = 5.0
_KEEPALIVE = 10


class MqttSink(Sink):
    """Publishes below one topic: ``touch``, ``touches``, ``events``, and ``status``.

    ``touch`` is what happens to one: onset, move, release. ``status``, online or offline, is kept
    by the broker: it is offline while no frames come, and the broker turns it so when we vanish.
    """

    period = PERIOD

    def __init__(self, url: SplitResult, port: int, naming: Naming) -> None:
        self.naming = naming
        self.name = f"mqtt://{url.hostname}:{port}/{naming.namespace}"
        self._url, self._port = url, port
        self._paho = needed("paho.mqtt.client", "mqtt", _WHERE, SinkError)
        self._client: Any = None

    def open(self, stream: Stream) -> None:
        """Connect; SinkError when the broker does not let us in."""
        self._stream, self._status = stream, ""
        paho = self._paho
        client = paho.Client(paho.CallbackAPIVersion.VERSION2, reconnect_on_failure=False)
        self._client = client
        if self._url.username:
            password = unquote(self._url.password) if self._url.password else None
            client.username_pw_set(unquote(self._url.username), password)
        client.connect_timeout = _PATIENCE
        client.will_set(stream.naming.topic("status"), "offline", retain=True)
        answer = _Answer()
        client.on_connect = answer
        client.connect(self._url.hostname, self._port, keepalive=_KEEPALIVE)
        client.loop_start()
        answer.check(self.name)
        self._say("online")

    def publish(self, item: Item) -> None:
        """Send what is worth a message."""
        if isinstance(item, Event):
            self._put("events", encode_json(event_content(self._stream, item)))
            return
        self._say("offline" if item.voltages is None else "online")
        for content in item.happenings():
            self._put("touch", encode_json(content))
        if item.is_due:
            self._put("touches", encode_json(item.content()))

    def close(self) -> None:
        """Say that we are offline, and disconnect."""
        client, self._client = self._client, None
        if client is None:
            return
        if client.is_connected():
            topic = self._stream.naming.topic("status")
            last = client.publish(topic, "offline", retain=True)
            last.wait_for_publish(_PATIENCE)
            client.disconnect()
        client.loop_stop()

    def _say(self, status: str) -> None:
        """Have the broker keep whether frames come, where that has changed."""
        if status != self._status:
            self._put("status", status.encode(), keep=True)
            self._status = status

    def _put(self, name: str, data: bytes, *, keep: bool = False) -> None:
        sent = self._client.publish(self._stream.naming.topic(name), data, retain=keep)
        if sent.rc:
            raise SinkError(self._paho.error_string(sent.rc), where=self.name)


class _Answer:
    """What the broker says to our wish to connect; called from the client's thread."""

    def __init__(self) -> None:
        self._came = threading.Event()
        self._refused = ""

    def __call__(self, *answer: Any) -> None:
        reason = answer[3]
        self._refused = str(reason) if reason.is_failure else ""
        self._came.set()

    def check(self, where: str) -> None:
        """Wait for the answer; SinkError where it is no."""
        if not self._came.wait(_PATIENCE):
            raise SinkError(f"the broker did not answer within {_PATIENCE:.0f} s", where=where)
        if self._refused:
            raise SinkError(f"the broker refused the connection: {self._refused}", where=where)


def open_mqtt(argument: str) -> MqttSink:
    """``mqtt://[USER:PASSWORD@]HOST[:1883][/TOPIC][?frame=NAME]``."""
    try:
        url = urlsplit(f"mqtt:{argument}")
        port = url.port or DEFAULT_PORT
    except ValueError as error:
        raise SinkError(str(error), where=_WHERE) from None
    if not url.hostname or "#" in argument or "+" in url.path or "@" in url.query:
        raise SinkError(
            f'expected mqtt://HOST:PORT/TOPIC, got "mqtt:{argument.rpartition("@")[2]}"',
            where=_WHERE,
            hint="for example mqtt://127.0.0.1:1883/robot/skin",
        )
    options = options_of(filter(None, url.query.split("&")), ("frame",), _WHERE)
    naming = Naming.of(options, _WHERE)
    topic = url.path.strip("/") or naming.namespace  # MQTT's may be called anything
    return MqttSink(url, port, replace(naming, namespace=topic))
