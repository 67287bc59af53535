"""The sink ``zenoh``: ROS 2 messages in CDR over Zenoh, with no ROS 2 on this machine."""

from __future__ import annotations

import os
from collections import Counter
from typing import Any

from tomoskin.core import SinkError
from tomoskin.run.sinks.cdr import encode_cdr
from tomoskin.run.sinks.consumer import needed, options_of
from tomoskin.run.sinks.naming import NAMES, Naming
from tomoskin.run.sinks.ros import TOPICS, RosMessage, RosView
from tomoskin.run.sinks.ros_types import dds_name, type_hash
from tomoskin.run.sinks.sink import Item, Stream

_WHERE = "sink zenoh"
_PATIENCE = 5000
"""Ms in which an endpoint must answer."""


class ZenohSink:
    """Puts messages of :data:`~tomoskin.run.sinks.ros.TOPICS`.

    Parameters
    ----------
    endpoint
        A router or peer to connect to, such as ``tcp/192.168.1.5:7447``; nobody is searched for
        then. "" for any peer that Zenoh finds by itself.
    domain
        ROS domain: keys and attachments are then those of ``rmw_zenoh``; None for plain keys,
        as subscribers of Zenoh and ``zenoh-bridge-ros2dds`` have them.
    naming
        Of topics and frame.
    """

    def __init__(self, endpoint: str, domain: int | None, naming: Naming) -> None:
        self.name = f"zenoh {endpoint or 'peers'}"
        self._endpoint, self._domain, self._naming = endpoint, domain, naming
        self._zenoh = needed("zenoh", "zenoh")
        self._ext = needed("zenoh.ext", "zenoh")
        self._identity = list(os.urandom(16))
        self._session: Any = None

    def open(self, stream: Stream) -> None:
        """Join; SinkError when the endpoint does not answer."""
        config = self._zenoh.Config()
        if self._endpoint:
            config.insert_json5("connect/endpoints", f'["{self._endpoint}"]')
            config.insert_json5("connect/exit_on_failure", "true")
            config.insert_json5("connect/timeout_ms", str(_PATIENCE))
            config.insert_json5("scouting/multicast/enabled", "false")
            config.insert_json5("listen/endpoints", "[]")
        try:
            self._session = self._zenoh.open(config)
        except self._zenoh.ZError as error:
            reason = str(error).partition(" at /")[0]  # where in its own sources
            raise SinkError(f"cannot be joined: {reason}", where=self.name) from error
        naming = self._naming.of_skin(stream)
        self._keys = {topic: _key(naming, topic, self._domain) for topic in TOPICS}
        self._view = RosView(stream, naming)
        self._sent: Counter[str] = Counter()

    def publish(self, item: Item) -> None:
        """Put the messages of ``item``."""
        for message in self._view.of(item):
            data = encode_cdr(TOPICS[message.topic], message.value)
            key = self._keys[message.topic]
            if self._domain is None:
                self._session.put(key, data)
            else:
                self._session.put(key, data, attachment=self._attachment(message))

    def close(self) -> None:
        """Leave."""
        session, self._session = self._session, None
        if session is not None:
            session.close()

    def _attachment(self, message: RosMessage) -> Any:
        """Number, time and origin, without which ``rmw_zenoh`` takes no message."""
        self._sent[message.topic] += 1
        ext = self._ext
        number, stamp = ext.Int64(self._sent[message.topic]), ext.Int64(message.stamp)
        origin = [ext.UInt8(byte) for byte in self._identity]
        named = ("sequence_number", number, "source_timestamp", stamp, "source_gid", origin)
        return ext.z_serialize(named)


def open_zenoh(argument: str) -> ZenohSink:
    """``zenoh:ENDPOINT,domain=N`` and the options of a naming; each may be left out."""
    words = [word for word in argument.split(",") if word]
    endpoints = [word for word in words if "=" not in word]
    named = [word for word in words if "=" in word]
    options = options_of(named, ("domain", *NAMES), _WHERE)
    domain = options.get("domain", "0")
    bad = [word for word in endpoints if "/" not in word or '"' in word] + endpoints[1:]
    if bad or not (domain.isascii() and domain.isdigit()):
        raise SinkError(
            f'expected an endpoint, then perhaps domain=N, got "{[*bad, domain][0]}"',
            where=_WHERE,
            hint="for example zenoh:tcp/192.168.1.5:7447,domain=0,namespace=left_arm",
        )
    number = int(domain) if "domain" in options else None
    return ZenohSink("".join(endpoints), number, Naming.of(options, _WHERE))


def _key(naming: Naming, topic: str, domain: int | None) -> str:
    """As the bridge has it, or as ``rmw_zenoh`` does: domain, topic, type and its hash."""
    full, kind = naming.topic(topic), TOPICS[topic]
    return full if domain is None else f"{domain}/{full}/{dds_name(kind)}/{type_hash(kind)}"
