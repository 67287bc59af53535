"""The sink ``mqtt``: touches and events as JSON, for a broker."""

from __future__ import annotations

import threading
from dataclasses import replace
from typing import Any
from urllib.parse import SplitResult, unquote, urlsplit

from tomoskin.core import Event, SinkError, encode_json
from tomoskin.run.sinks.consumer import needed, options_of
from tomoskin.run.sinks.contact import Contacts, contact_of, event_content
from tomoskin.run.sinks.naming import Naming
from tomoskin.run.sinks.sink import Item, Stream, TouchPace

DEFAULT_PORT = 1883

PERIOD = 0.05
"""Seconds between two messages of touches that go on; beginnings and ends are sent at once."""

_PATIENCE = 5.0
_KEEPALIVE = 10


class MqttSink:
    """Publishes below one topic: ``touch``, ``touches``, ``events``, and ``status``.

    ``touch`` is what happens to one: onset, move, release. ``status``, online or offline, is kept
    by the broker, which turns it to offline by itself when we vanish.
    """

    def __init__(self, url: SplitResult, port: int, naming: Naming) -> None:
        self._root = self._naming = naming
        self.name = f"mqtt://{url.hostname}:{port}/{naming.namespace}"
        self._url, self._port = url, port
        self._paho = needed("paho.mqtt.client", "mqtt")
        self._client: Any = None

    def open(self, stream: Stream) -> None:
        """Connect; SinkError when the broker does not let us in."""
        self._stream, self._naming = stream, self._root.of_skin(stream)
        paho = self._paho
        client = paho.Client(paho.CallbackAPIVersion.VERSION2, reconnect_on_failure=False)
        self._client = client
        if self._url.username:
            password = unquote(self._url.password) if self._url.password else None
            client.username_pw_set(unquote(self._url.username), password)
        client.connect_timeout = _PATIENCE
        client.will_set(f"{self._naming.namespace}/status", "offline", retain=True)
        answer = _Answer()
        client.on_connect = answer
        client.connect(self._url.hostname, self._port, keepalive=_KEEPALIVE)
        client.loop_start()
        answer.check(self.name)
        self._pace = TouchPace(PERIOD)
        self._put("status", b"online", keep=True)

    def publish(self, item: Item) -> None:
        """Send what is worth a message."""
        if isinstance(item, Event):
            self._put("events", encode_json(event_content(self._stream, self._naming, item)))
            return
        due = self._pace.is_due(item)
        if not (due or item.happened):
            return
        contacts = Contacts.of(self._stream, self._naming, item)
        for event in item.happened:
            about = {"time_s": event.host_time, "event": event.kind, **contacts.header()}
            row = contact_of(self._stream, event.touch).content()
            self._put("touch", encode_json(about | row))
        if due:
            self._put("touches", encode_json(contacts.content()))

    def close(self) -> None:
        """Say that we go, and go."""
        client, self._client = self._client, None
        if client is None:
            return
        if client.is_connected():
            last = client.publish(f"{self._naming.namespace}/status", "offline", retain=True)
            last.wait_for_publish(_PATIENCE)
            client.disconnect()
        client.loop_stop()

    def _put(self, name: str, data: bytes, *, keep: bool = False) -> None:
        sent = self._client.publish(f"{self._naming.namespace}/{name}", data, retain=keep)
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
        """Wait for it."""
        if not self._came.wait(_PATIENCE):
            raise SinkError(f"the broker did not answer within {_PATIENCE:.0f} s", where=where)
        if self._refused:
            raise SinkError(f"the broker refused the connection: {self._refused}", where=where)


def open_mqtt(argument: str) -> MqttSink:
    """``mqtt://[USER:PASSWORD@]HOST[:1883][/TOPIC][?frame=NAME]``."""
    where = "sink mqtt"
    try:
        url = urlsplit(f"mqtt:{argument}")
        port = url.port or DEFAULT_PORT
    except ValueError as error:
        raise SinkError(str(error), where=where) from None
    if not url.hostname or "#" in argument or "+" in url.path or "@" in url.query:
        raise SinkError(
            f'expected mqtt://HOST:PORT/TOPIC, got "mqtt:{argument.rpartition("@")[2]}"',
            where=where,
            hint="for example mqtt://127.0.0.1:1883/robot/skin",
        )
    options = options_of(filter(None, url.query.split("&")), ("frame",), where)
    naming = Naming.of(options, where)
    topic = url.path.strip("/") or naming.namespace  # MQTT's may be called anything
    return MqttSink(url, port, replace(naming, namespace=topic))
