"""The sink ``ros2``: a DDS participant that ROS 2 nodes hear, with no ROS 2 on this machine."""

from __future__ import annotations

import functools
import os
import threading
import time
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple
from uuid import uuid4

from tomoskin.core import SinkError, TomoskinError, needed
from tomoskin.extras.ros2.ros_types import NODE_TYPES, Field, dds_name, encode_cdr, type_hash
from tomoskin.extras.ros2.ros_view import KEPT, TOPICS, ros_messages
from tomoskin.files.messages import NAMES, Item, Naming, Stream
from tomoskin.run.sinks import Sink, options_of

_WHERE = "sink ros2"
_DEPTH = 10
"""Messages that a publisher keeps for slow subscribers, as ROS 2's own do."""

_BLOCKING = 100_000_000
"""Ns that a write may wait for a slow subscriber."""


class Ros2Sink(Sink):
    """Publishes messages of :data:`TOPICS` by CycloneDDS.

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
    release
        Of :data:`GID_SIZES`: whose nodes see its name in the graph.
    """

    def __init__(
        self,
        domain: int,
        naming: Naming,
        folder: Path | None = None,
        release: str = "jazzy",
    ) -> None:
        self.name = f"ros2 /{naming.namespace}, domain {domain}"
        self.naming, self._domain, self._folder = naming, domain, folder
        self._release = release
        self._node: Node | None = None
        self._dds = {
            name: needed(f"cyclonedds.{name}", "ros2", _WHERE, SinkError)
            for name in ("core", "domain", "pub", "sub", "topic", "idl")
        }
        self._writers: dict[str, Any] = {}
        self._readers: dict[str, int] = {}

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
            name, services = stream.naming.namespace, _services(stream, self._folder)
            self._node = Node(self._dds, participant, name, services)
            self._node.announce(GID_SIZES[self._release], self._writers.values())
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
            topic = message.topic
            if topic in KEPT or self._readers.get(topic):
                encoded = encoded_as(TOPICS[topic], message.value)
                self._writers[topic].write(encoded, message.stamp)

    def close(self) -> None:
        """Leave: with the last reference to a writer its participant goes too."""
        if self._node is not None:
            self._node.close()
        self._node, self._writers = None, {}

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
        entity = self._dds["topic"].Topic(participant, name, struct_of(kind))

        def count(_: Any, status: Any) -> None:  # to be asked for each message would cost more
            self._readers[topic] = status.current_count

        listener = core.Listener(on_publication_matched=count)
        return self._dds["pub"].DataWriter(participant, entity, qos=qos, listener=listener)


def _services(stream: Stream, folder: Path | None) -> dict[str, Service]:
    """What nodes may ask for, by the full names of services."""
    services = parameter_services(
        {
            "skin": (stream.skin, "Name of the skin"),
            "source": (stream.source, "Where its frames come from"),
            "frame_id": (stream.naming.frame_id, "Frame of positions"),
            "parent": (stream.parent, "Link that the skin is known to lie on"),
            "electrodes": (stream.pattern.n_electrodes, "Number of electrodes"),
            "measurements": (stream.pattern.n_meas, "Number of voltages in a frame"),
        }
    )
    requests = {"take_reference": "reference"}
    if folder is not None:
        requests |= {"start_recording": "record", "stop_recording": "stop"}
    if stream.obey is not None:
        for name, request in requests.items():
            services[name] = trigger(functools.partial(stream.obey, request, folder or Path()))
    return {stream.naming.topic(name): service for name, service in services.items()}


def open_ros2(argument: str) -> Ros2Sink:
    """``ros2``, ``ros2:domain=N,namespace=NAME,frame=NAME,parent=NAME,at=X/Y/Z,folder=DIR``,
    ``release=humble``.

    Raises SinkError.

    Without ``domain`` it is the environment's ROS_DOMAIN_ID, as for ROS 2 itself.
    """
    options = options_of(
        filter(None, argument.split(",")), ("domain", *NAMES, "folder", "release"), _WHERE
    )
    folder = Path(options["folder"]) if "folder" in options else None
    if folder is not None and not folder.is_dir():
        raise SinkError(f'expected a folder that exists, got "{folder}"', where=_WHERE)
    release = options.get("release", "jazzy")
    if release not in GID_SIZES:
        raise SinkError(
            f'expected release={" or ".join(GID_SIZES)}, got "{release}"',
            where=_WHERE,
            hint="humble is for Humble, jazzy for Iron and all later ones",
        )
    return Ros2Sink(ros_domain(options, _WHERE), Naming.of(options, _WHERE), folder, release)


_MOST_DOMAINS = 232

Action = Callable[[], str]
"""Does what is asked, and says what that was; raises TomoskinError."""

Value = dict[str, Any]

GID_SIZES = {"jazzy": 16, "humble": 24}
"""Bytes of an identity in the graph, by the release of ROS 2: Iron and later have Jazzy's."""

_OFTEN = 0.05
"""Seconds between two looks for requests."""

_PATIENCE = 1.0
"""Seconds in which the reader of whoever asks must have been discovered."""

_AT_ONCE = 10
_TYPES = {bool: (1, "bool_value"), int: (2, "integer_value"), str: (4, "string_value")}
"""Number of each type of a parameter, and the field that holds it."""


class Service(NamedTuple):
    """A service of ROS 2: its type without the ending, and what it answers to a request."""

    kind: str
    answer: Callable[[Any], Value]


def trigger(action: Action) -> Service:
    """A service of ``std_srvs/srv/Trigger``."""

    def answer(_: Any) -> Value:
        try:
            return {"success": True, "message": action()}
        except TomoskinError as error:
            return {"success": False, "message": str(error)}

    return Service("std_srvs/srv/Trigger", answer)


def parameter_services(parameters: Mapping[str, tuple[Any, str]]) -> dict[str, Service]:
    """Services by name that list, give and describe parameters, and refuse to set them.

    ``parameters``: value and description of each by its name.
    """

    def listed(request: Any) -> Value:
        some = [n for n in parameters if not request.prefixes or n in request.prefixes]
        return {"result": {"names": some}}

    def given(request: Any) -> Value:
        return {
            "values": [_value(parameters[n][0]) if n in parameters else {} for n in request.names]
        }

    def described(request: Any) -> Value:
        return {
            "descriptors": [
                {"name": name, "read_only": True, "description": parameters[name][1]}
                | {"type": _value(parameters[name][0])["type"]}
                for name in request.names
                if name in parameters
            ]
        }

    def refused(request: Any) -> Value:
        why = {"reason": "read-only: the command line and the skin file set it"}
        return {"results": [why for _ in request.parameters]}

    answers = {
        "ListParameters": listed,
        "GetParameters": given,
        "DescribeParameters": described,
        "SetParameters": refused,
    }
    return {
        name.replace("P", "_p").lower(): Service(f"rcl_interfaces/srv/{name}", answer)
        for name, answer in answers.items()
    }


def _value(value: Any) -> Value:
    number, field = _TYPES[type(value)]
    return {"type": number, field: value}


class Node:
    """A node of ROS 2: says in the graph what is its own, and answers services from a thread.

    DDS has topics only: a service is one for requests and one for replies. By ``rmw_cyclonedds``
    both begin with who asks and the number of the request, and a reply repeats them. Other
    middlewares of ROS 2 keep them elsewhere, and cannot be answered.

    Parameters
    ----------
    dds
        Modules of CycloneDDS by name.
    participant
        The node's own.
    name
        In full, without its first "/".
    services
        By their full names, without the first "/".
    """

    def __init__(
        self, dds: Mapping[str, Any], participant: Any, name: str, services: Mapping[str, Service]
    ) -> None:
        self._dds, self._participant = dds, participant
        self._namespace, _, self._name = f"/{name}".rpartition("/")
        self._ends = [self._end(*named) for named in services.items()]
        self._ended = threading.Event()
        self._graph: Any = None
        self._thread = threading.Thread(target=self._serve, name="tomoskin-services", daemon=True)
        self._thread.start()

    def announce(self, size: int, writers: Iterable[Any]) -> None:
        """Say in the graph that it is there, with its ``writers`` and services.

        ``size``: bytes of an identity there. Nodes that come later hear it too.
        """
        core, types = self._dds["core"], self._dds["idl"].types
        gid = self._struct("Gid", {"data": types.array[types.uint8, size]})
        ends = {"reader_gid_seq": types.sequence[gid], "writer_gid_seq": types.sequence[gid]}
        node = self._struct("NodeEntitiesInfo", {"node_namespace": str, "node_name": str} | ends)
        nodes = {"node_entities_info_seq": types.sequence[node]}
        info = self._struct("ParticipantEntitiesInfo", {"gid": gid} | nodes)

        def identity(entity: Any) -> Any:
            return gid([*entity.guid.bytes.ljust(size, b"\0")])

        readers = [identity(reader) for reader, *_ in self._ends]
        own = [*writers, *(writer for _, writer, _ in self._ends)]
        about = node(self._namespace or "/", self._name, readers, [*map(identity, own)])
        qos = core.Qos(
            core.Policy.Reliability.Reliable(1_000_000_000),
            core.Policy.Durability.TransientLocal,
            core.Policy.History.KeepLast(1),
            core.Policy.DataRepresentation(use_cdrv0_representation=True),
        )
        topic = self._dds["topic"].Topic(self._participant, "ros_discovery_info", info)
        self._graph = self._dds["pub"].DataWriter(self._participant, topic, qos=qos)
        self._graph.write(info(identity(self._participant), [about]))

    def close(self) -> None:
        """Answer no more; returns when the last answer has been given."""
        self._ended.set()
        self._thread.join()
        self._ends, self._graph = [], None

    def _struct(self, name: str, fields: Value) -> Any:
        make = self._dds["idl"].make_idl_struct
        return make(f"{name}_", f"rmw_dds_common.msg.dds_.{name}_", fields)

    def _end(self, name: str, service: Service) -> tuple[Any, Any, Callable[[Any], Any]]:
        core = self._dds["core"]
        qos = core.Qos(
            core.Policy.Reliability.Reliable(1_000_000_000),
            core.Policy.History.KeepLast(_AT_ONCE),
            core.Policy.DataRepresentation(use_cdrv0_representation=True),
            core.Policy.Userdata(f"serviceid={uuid4().hex};".encode()),
        )
        topic = functools.partial(self._dds["topic"].Topic, self._participant)
        asked = topic(f"rq/{name}Request", struct_of(f"{service.kind}_Request"))
        replied = topic(f"rr/{name}Reply", struct_of(f"{service.kind}_Response"))

        def answer(request: Any) -> Any:
            head = {"guid": request.guid, "seq": request.seq}
            return encoded_as(f"{service.kind}_Response", head | service.answer(request))

        return (
            self._dds["sub"].DataReader(self._participant, asked, qos=qos),
            self._dds["pub"].DataWriter(self._participant, replied, qos=qos),
            answer,
        )

    def _serve(self) -> None:
        while not self._ended.wait(_OFTEN):
            for reader, writer, answer in self._ends:
                for request in reader.take(N=_AT_ONCE):
                    if request.sample_info.valid_data:
                        self._reply(answer(request), writer)

    def _reply(self, reply: Any, writer: Any) -> None:
        deadline = time.monotonic() + _PATIENCE
        while not writer.get_matched_subscriptions() and time.monotonic() < deadline:
            self._ended.wait(_OFTEN)
        writer.write(reply)


def ros_domain(options: Mapping[str, str], where: str) -> int:
    """The option ``domain``, else that of the environment. Raises SinkError."""
    text = options.get("domain", os.environ.get("ROS_DOMAIN_ID") or "0")
    if not (text.isascii() and text.isdigit() and int(text) <= _MOST_DOMAINS):
        raise SinkError(f'expected a domain from 0 to {_MOST_DOMAINS}, got "{text}"', where=where)
    return int(text)


@functools.cache
def struct_of(kind: str) -> Any:
    """CycloneDDS' class of a message by its name, of :data:`NODE_TYPES`."""
    idl = needed("cyclonedds.idl", "ros2", _WHERE, SinkError)
    fields = {name: _type_of(Field.of(text)) for name, text in NODE_TYPES[kind].items()}
    name = dds_name(kind)
    return idl.make_idl_struct(name.rpartition(":")[2], name.replace("::", "."), fields)


def _type_of(field: Field) -> Any:
    types = needed("cyclonedds.idl.types", "ros2", _WHERE, SinkError)
    plain: Mapping[str, Any] = {"string": str, "bool": bool}
    if field.kind in NODE_TYPES:
        kind = struct_of(field.kind)
    else:
        kind = plain.get(field.kind) or getattr(types, field.kind)
    if field.length is None:
        return kind
    return types.array[kind, field.length] if field.length else types.sequence[kind]


def encoded_as(kind: str, value: Mapping[str, Any]) -> Any:
    """A message of CycloneDDS with those fields; one that is not there is zero, or empty."""
    return _encoded(struct_of(kind))(encode_cdr(kind, value))


@functools.cache
def _encoded(struct: Any) -> Any:
    """A message that has been encoded already: CycloneDDS asks a sample for its bytes."""

    class Encoded(struct):  # type: ignore[misc]
        def __init__(self, encoded: bytes) -> None:
            self.encoded = encoded

        def serialize(self, **_: Any) -> bytes:
            return self.encoded

    return Encoded
