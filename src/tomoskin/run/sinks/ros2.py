"""The sink ``ros2``: a DDS participant that ROS 2 nodes hear, with no ROS 2 on this machine."""

from __future__ import annotations

import functools
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from tomoskin.core import SinkError, needed
from tomoskin.files.messages import (
    KEPT,
    NAMES,
    TOPICS,
    TYPES,
    Field,
    Item,
    Naming,
    Stream,
    dds_name,
    encode_cdr,
    ros_messages,
    type_hash,
)
from tomoskin.run.sinks.ros2_services import Action, TriggerServices
from tomoskin.run.sinks.sink import Sink, options_of

_WHERE = "sink ros2"
_DEPTH = 10
"""Messages that a publisher keeps for slow subscribers, as ROS 2's own do."""

_BLOCKING = 100_000_000
"""Ns that a write may wait for a slow subscriber."""

_MOST_DOMAINS = 232


class Ros2Sink(Sink):
    """Publishes messages of :data:`~tomoskin.files.messages.TOPICS` by CycloneDDS.

    Topics, types and their hashes are as ROS 2 has them, in user data as its own middlewares put
    them there.

    Parameters
    ----------
    domain
        ROS domain, 0 to 232.
    naming
        Of topics and frame.
    folder
        Where recordings go that nodes ask for; None: nowhere, and nobody may ask.
    """

    def __init__(self, domain: int, naming: Naming, folder: Path | None = None) -> None:
        self.name = f"ros2 /{naming.namespace}, domain {domain}"
        self.naming, self._domain, self._folder = naming, domain, folder
        self._services: TriggerServices | None = None
        self._dds = {
            name: needed(f"cyclonedds.{name}", "ros2", _WHERE, SinkError)
            for name in ("core", "domain", "pub", "sub", "topic", "idl")
        }
        self._writers: dict[str, Any] = {}

    def open(self, stream: Stream) -> None:
        """Join the domain; SinkError when there is no network for it."""
        core = self._dds["core"]
        try:
            participant = self._dds["domain"].DomainParticipant(
                self._domain, qos=core.Qos(core.Policy.Userdata(b"enclave=/;"))
            )
            self._writers = {
                topic: self._writer(participant, stream.naming, topic) for topic in TOPICS
            }
            if stream.obey is not None:
                actions = _actions(stream, stream.obey, self._folder)
                self._services = TriggerServices(self._dds, participant, actions)
        except core.DDSException as error:
            raise SinkError(
                f"cannot join domain {self._domain}: {error}",
                where=self.name,
                hint="set CYCLONEDDS_URI to choose the network interface",
            ) from error
        self._stream = stream
        if not stream.parent:
            self.hint = (
                f'no parent of its frame "{stream.naming.frame_id}" is published: choose it as '
                "Fixed Frame in RViz, or give parent=LINK,at=X/Y/Z"
            )

    def publish(self, item: Item) -> None:
        """Write the messages of ``item``; the source time is that of the measurement."""
        for message in ros_messages(self._stream, item):
            writer = self._writers[message.topic]
            if message.topic not in KEPT and not writer.get_matched_subscriptions():
                continue  # bytes are the dear part, and nobody listens
            data = encode_cdr(TOPICS[message.topic], message.value)
            writer.write(_encoded(writer.data_type)(data), message.stamp)

    def close(self) -> None:
        """Leave: with the last reference to a writer its participant goes too."""
        if self._services is not None:
            self._services.close()
        self._services, self._writers = None, {}

    def _writer(self, participant: Any, naming: Naming, topic: str) -> Any:
        core, kind = self._dds["core"], TOPICS[topic]
        policy = core.Policy
        kept = topic in KEPT
        qos = core.Qos(
            policy.Reliability.Reliable(_BLOCKING),
            policy.History.KeepLast(1 if kept else _DEPTH),
            policy.Durability.TransientLocal if kept else policy.Durability.Volatile,
            policy.DataRepresentation(use_cdrv0_representation=True),
            policy.Userdata(f"typehash={type_hash(kind)};".encode()),
        )
        name = f"rt/{naming.topic(topic)}"
        return self._dds["pub"].DataWriter(
            participant, self._dds["topic"].Topic(participant, name, struct_of(kind)), qos=qos
        )


def _actions(
    stream: Stream, obey: Callable[[str, Path], str], folder: Path | None
) -> dict[str, Action]:
    """What nodes may ask for, by the names of services."""

    requests = {"take_reference": "reference"}
    if folder is not None:
        requests |= {"start_recording": "record", "stop_recording": "stop"}
    return {
        stream.naming.topic(name): functools.partial(obey, request, folder or Path())
        for name, request in requests.items()
    }


def open_ros2(argument: str) -> Ros2Sink:
    """``ros2``, ``ros2:domain=N,namespace=NAME,frame=NAME,parent=NAME,at=X/Y/Z,folder=DIR``.

    Raises SinkError.

    Without ``domain`` it is the environment's ROS_DOMAIN_ID, as for ROS 2 itself.
    """
    options = options_of(filter(None, argument.split(",")), ("domain", *NAMES, "folder"), _WHERE)
    folder = Path(options["folder"]) if "folder" in options else None
    if folder is not None and not folder.is_dir():
        raise SinkError(f'expected a folder that exists, got "{folder}"', where=_WHERE)
    return Ros2Sink(ros_domain(options, _WHERE), Naming.of(options, _WHERE), folder)


def ros_domain(options: Mapping[str, str], where: str) -> int:
    """The option ``domain``, else that of the environment. Raises SinkError."""
    text = options.get("domain", os.environ.get("ROS_DOMAIN_ID") or "0")
    if not (text.isascii() and text.isdigit() and int(text) <= _MOST_DOMAINS):
        raise SinkError(f'expected a domain from 0 to {_MOST_DOMAINS}, got "{text}"', where=where)
    return int(text)


@functools.cache
def struct_of(kind: str) -> Any:
    """CycloneDDS' class of a message by its name (:data:`~tomoskin.files.messages.TYPES`)."""
    idl = needed("cyclonedds.idl", "ros2", _WHERE, SinkError)
    fields = {name: _type_of(Field.of(text)) for name, text in TYPES[kind].items()}
    name = dds_name(kind)
    return idl.make_idl_struct(name.rpartition(":")[2], name.replace("::", "."), fields)


def _type_of(field: Field) -> Any:
    types = needed("cyclonedds.idl.types", "ros2", _WHERE, SinkError)
    plain: Mapping[str, Any] = {"string": str, "bool": bool}
    if field.kind in TYPES:
        kind = struct_of(field.kind)
    else:
        kind = plain.get(field.kind) or getattr(types, field.kind)
    if field.length is None:
        return kind
    return types.array[kind, field.length] if field.length else types.sequence[kind]


@functools.cache
def _encoded(struct: Any) -> Any:
    """A message that has been encoded already: CycloneDDS asks a sample for its bytes."""

    class Encoded(struct):  # type: ignore[misc]
        def __init__(self, encoded: bytes) -> None:
            self.encoded = encoded

        def serialize(self, **_: Any) -> bytes:
            return self.encoded

    return Encoded
