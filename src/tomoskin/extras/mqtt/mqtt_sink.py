"""The sink ``mqtt``: touches and events as JSON, for a broker."""

from __future__ import annotations

import contextlib
import socket
from collections import deque
from dataclasses import replace
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any
from urllib.parse import SplitResult, unquote, urlsplit

from tomoskin.core import Event, SinkError, encode_json, needed
from tomoskin.files.messages import Item, Naming, Stream, event_content, happenings
from tomoskin.run.sinks import Sink, options_of, tried_with

DEFAULT_PORT, TLS_PORT = 1883, 8883

PERIOD = 0.05
"""Seconds between two messages of touches that go on; beginnings and ends are sent at once."""

_WHERE, _SYSTEM = "sink mqtt", "system"
_PATIENCE = 5.0
_KEEPALIVE = 10

_EXPIRY = 3
"""Seconds for which the broker keeps touches: what is older is not true any more. Mosquitto 2.0
counts whole seconds of its clock, and so keeps them for 2 to 3."""

_MOST_OWED = 100
"""Messages that are sent again after the broker was away; the oldest make room."""


class MqttSink(Sink):
    """Publishes below one topic: ``touch``, ``touches``, ``events``, and ``status``.

    ``touch`` is what happens to one: onset, move, release. All but moves reach the broker at least
    once (quality of service 1). ``status``, online or offline, is kept by the broker: it is
    offline while no frames come, and the broker turns it so when we vanish. ``touches`` are kept
    until they are old.

    Parameters
    ----------
    url, port
        Of the broker.
    tls
        "" for none; else the file of the authority that signed the broker's certificate, or
        "system" for those that the system trusts.
    naming
        Of topics and frame.
    """

    period = PERIOD

    def __init__(self, url: SplitResult, port: int, tls: str, naming: Naming) -> None:
        self.naming = naming
        self.name = f"mqtt{'s' if tls else ''}://{url.hostname}:{port}/{naming.namespace}"
        self._url, self._port, self._tls = url, port, tls
        self._paho = needed("paho.mqtt.client", "mqtt", _WHERE, SinkError)
        self._client: Any = None
        self._owed: deque[tuple[str, bytes, Any]] = deque(maxlen=_MOST_OWED)

    def open(self, stream: Stream) -> None:
        """Connect; SinkError when the broker does not let us in."""
        self._stream, self._status = stream, ""
        paho = self._paho
        client = paho.Client(
            paho.CallbackAPIVersion.VERSION2, protocol=paho.MQTTv5, reconnect_on_failure=False
        )
        self._client = client
        if self._tls:
            client.tls_set(None if self._tls == _SYSTEM else self._tls)
        if self._url.username:
            password = unquote(self._url.password) if self._url.password else None
            client.username_pw_set(unquote(self._url.username), password)
        client.connect_timeout = _PATIENCE
        client.will_set(stream.naming.topic("status"), "offline", qos=1, retain=True)
        answers: SimpleQueue[Any] = SimpleQueue()
        client.on_connect = lambda *answer: answers.put(answer[3])
        client.connect(self._url.hostname, self._port, keepalive=_KEEPALIVE)
        # a second message of a frame must not wait until the first is acknowledged, 40 ms
        client.socket().setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        client.loop_start()
        _check_answer(answers, self.name)
        self._say("online")
        self._pay()

    def publish(self, item: Item) -> None:
        """Send what is worth a message."""
        if isinstance(item, Event):
            self._put("events", encode_json(event_content(self._stream, item)))
            return
        self._say("offline" if item.voltages is None else "online")
        for content in happenings(item):
            self._put("touch", encode_json(content), qos=int(content["event"] != "move"))
        if item.is_due:
            self._put("touches", encode_json(item.content()), keep=_EXPIRY)

    def _pay(self) -> None:
        """Send again what may not have come; where the link goes meanwhile, the rest stays owed."""
        owed, self._owed = self._owed, deque(maxlen=_MOST_OWED)
        owed = deque(item for item in owed if item[2].rc or not item[2].is_published())
        try:
            while owed:
                name, data, _ = owed.popleft()
                self._put(name, data, qos=1)
        finally:
            self._owed.extend(owed)

    def close(self) -> None:
        """Say that we are offline, and disconnect."""
        client, self._client = self._client, None
        if client is None:
            return
        if client.is_connected():
            topic = self._stream.naming.topic("status")
            last = client.publish(topic, "offline", qos=1, retain=True)
            # a broker that went just now takes no last word: it says so itself, by the will
            with contextlib.suppress(RuntimeError):
                last.wait_for_publish(_PATIENCE)
            client.disconnect()
        client.loop_stop()

    def _say(self, status: str) -> None:
        """Have the broker keep whether frames come, where that has changed."""
        if status != self._status:
            topic = self._stream.naming.topic("status")
            self._check(self._client.publish(topic, status, qos=1, retain=True))
            self._status = status

    def _put(self, name: str, data: bytes, *, qos: int = 0, keep: int = 0) -> None:
        """Send it; ``keep``: s for which the broker keeps it for those who come later."""
        properties = self._properties(keep) if keep else None
        topic = self._stream.naming.topic(name)
        sent = self._client.publish(topic, data, qos, retain=bool(keep), properties=properties)
        if qos:
            self._owed.append((name, data, sent))
            while self._owed and not sent.rc and self._owed[0][2].is_published():
                self._owed.popleft()
        self._check(sent)

    def _properties(self, expiry: int) -> Any:
        properties = self._paho.Properties(self._paho.PacketTypes.PUBLISH)
        properties.MessageExpiryInterval = expiry
        return properties

    def _check(self, sent: Any) -> None:
        if sent.rc:
            raise SinkError(self._paho.error_string(sent.rc), where=self.name)


def _check_answer(answers: SimpleQueue[Any], where: str) -> None:
    """Wait for what the broker says to our wish to connect; SinkError where it is no."""
    try:
        reason = answers.get(timeout=_PATIENCE)
    except Empty:
        why = f"the broker did not answer within {_PATIENCE:.0f} s"
        raise SinkError(why, where=where) from None
    if reason.is_failure:
        raise SinkError(f"the broker refused the connection: {reason}", where=where)


@tried_with("//127.0.0.1/tomoskin")
def open_mqtt(argument: str) -> MqttSink:
    """``mqtt://[USER:PASSWORD@]HOST[:PORT][/TOPIC][?frame=NAME&tls=system|FILE]``."""
    try:
        url = urlsplit(f"mqtt:{argument}")
        port = url.port
    except ValueError as error:
        raise SinkError(str(error), where=_WHERE) from None
    if not url.hostname or "#" in argument or "+" in url.path or "@" in url.query:
        raise SinkError(
            f'expected mqtt://HOST:PORT/TOPIC, got "mqtt:{argument.rpartition("@")[2]}"',
            where=_WHERE,
            hint="for example mqtt://127.0.0.1:1883/robot/skin",
        )
    options = options_of(filter(None, url.query.split("&")), ("frame", "tls"), _WHERE)
    tls = unquote(options.pop("tls", ""))
    if tls and tls != _SYSTEM and not Path(tls).is_file():
        raise SinkError(
            f'expected tls=system, or the file of an authority that exists, got "{tls}"',
            where=_WHERE,
        )
    naming = Naming.of(options, _WHERE)
    topic = url.path.strip("/") or naming.namespace  # MQTT's may be called anything
    port = port or (TLS_PORT if tls else DEFAULT_PORT)
    return MqttSink(url, port, tls, replace(naming, namespace=topic))
