"""A node of ROS 2 by CycloneDDS: types, its name in the graph, services, and parameters."""

from __future__ import annotations

import functools
import os
import threading
import time
from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple
from uuid import uuid4

from tomoskin.core import SinkError, TomoskinError, needed
from tomoskin.files.messages import NODE_TYPES, Field, dds_name, encode_cdr

_WHERE = "sink ros2"
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
    """CycloneDDS' class of a message by its name (:data:`~tomoskin.files.messages.NODE_TYPES`)."""
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
