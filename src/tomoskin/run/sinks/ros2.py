"""The sink ``ros2``: a DDS participant that ROS 2 nodes hear, with no ROS 2 on this machine."""

from __future__ import annotations

import functools
from pathlib import Path
from typing import Any

from tomoskin.core import SinkError, needed
from tomoskin.files.messages import (
    KEPT,
    NAMES,
    TOPICS,
    Item,
    Naming,
    Stream,
    ros_messages,
    type_hash,
)
from tomoskin.run.sinks.ros2_node import (
    GID_SIZES,
    Node,
    Service,
    encoded_as,
    parameter_services,
    ros_domain,
    struct_of,
    trigger,
)
from tomoskin.run.sinks.sink import Sink, options_of

_WHERE = "sink ros2"
_DEPTH = 10
"""Messages that a publisher keeps for slow subscribers, as ROS 2's own do."""

_BLOCKING = 100_000_000
"""Ns that a write may wait for a slow subscriber."""


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
    release
        Of :data:`~tomoskin.run.sinks.ros2_node.GID_SIZES`: whose nodes see its name in the graph.
    """

    def __init__(
        self, domain: int, naming: Naming, folder: Path | None = None, release: str = "jazzy"
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
