"""How a robot stands: the positions of its joints, live from ROS 2 or from a recording of it."""

from __future__ import annotations

import math
import threading
from bisect import bisect_right
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from mcap.reader import make_reader

from tomoskin.core import DataError, SinkError, SkinError, needed
from tomoskin.extras.ros2.ros2_sink import ros_domain, struct_of
from tomoskin.run.sinks import options_of

MAX_AGE = 0.5
"""Seconds from a joint state after which it says no more how the robot stands."""

_KIND = "sensor_msgs/msg/JointState"
_WHERE = "joint states"
_MOST = 4000
"""Positions that are kept of each joint of a live robot: some seconds."""

_AT_ONCE = 64

State = tuple[float, Any]
"""A message, and when it was sent: s since 1970, for messages that do not say."""


@dataclass
class _Track:
    """Positions of one joint by their times, s since 1970, in order."""

    times: list[float] = field(default_factory=list)
    positions: list[float] = field(default_factory=list)

    def add(self, time: float, position: float, most: int | None) -> None:
        """A time before the last means that the clock was set: the older ones say nothing."""
        if self.times and time < self.times[-1]:
            self.times.clear()
            self.positions.clear()
        self.times.append(time)
        self.positions.append(position)
        if most and len(self.times) > most:
            del self.times[: most // 2], self.positions[: most // 2]

    def at(self, time: float) -> tuple[float, float]:
        """The position at ``time``, between two states where it is; s from the nearest state."""
        after = bisect_right(self.times, time)
        ends = range(max(after - 1, 0), min(after + 1, len(self.times)))
        nearest = min(ends, key=lambda k: abs(self.times[k] - time))
        position, age = self.positions[nearest], abs(self.times[nearest] - time)
        other = next((k for k in ends if k != nearest), nearest)
        turn = self.positions[other] - position
        span = abs(self.times[other] - self.times[nearest])
        if 0 < span <= 2 * MAX_AGE and abs(turn) < math.pi:  # not where an angle starts anew
            position += turn * age / span
        return position, age


class JointStates:
    """How a robot stands at a time; may be asked from any thread.

    Parameters
    ----------
    take
        Gives the messages that have come since it was called last.
    source
        Where they come from, for messages.
    most
        Positions that are kept of each joint; None: all.
    """

    def __init__(
        self, take: Callable[[], Iterable[State]], source: str, most: int | None = None
    ) -> None:
        self.source, self._take, self._most = source, take, most
        self._tracks: dict[str, _Track] = {}
        self._lock = threading.Lock()

    def __call__(self, utc: float) -> Callable[[str], float]:
        """What gives the position of a joint, rad or m, at ``utc``, s since 1970.

        It raises SkinError where no state within half a second says it.
        """
        with self._lock:
            for sent, message in self._take():
                self._add(sent, message)
        return partial(self._position, utc)

    def _position(self, utc: float, joint: str) -> float:
        with self._lock:
            track = self._tracks.get(joint)
            position, age = track.at(utc) if track else (math.nan, math.inf)
        if age <= MAX_AGE:
            return position
        why = f"is {age:.1f} s from the frame" if track else "has not come"
        raise SkinError(
            f'pose unknown: the nearest state of the joint "{joint}" {why}', where=self.source
        )

    def _add(self, sent: float, message: Any) -> None:
        stamp = message.header.stamp
        time = stamp.sec + 1e-9 * stamp.nanosec or sent
        for name, position in zip(message.name, message.position, strict=False):
            if math.isfinite(position):
                self._tracks.setdefault(name, _Track()).add(time, position, self._most)


def joint_states(spec: str) -> JointStates:
    """Of ``ros2``, ``ros2:domain=N,topic=NAME``, or the path of an MCAP file of ROS 2.

    Raises
    ------
    SinkError
        Where there is no such topic or domain, or CycloneDDS is not installed.
    DataError
        When the file cannot be read, or holds no joint states.
    """
    name, _, argument = spec.partition(":")
    if name != "ros2":
        states = iter(list(_recorded(Path(spec))))  # the first who asks takes them all
        return JointStates(lambda: states, spec)
    options = options_of(filter(None, argument.split(",")), ("domain", "topic"), _WHERE)
    topic = options.get("topic", "joint_states").removeprefix("/")
    return JointStates(_listener(ros_domain(options, _WHERE), topic), f"/{topic}", _MOST)


def _listener(domain: int, topic: str) -> Callable[[], Iterable[State]]:
    """What reads the newest messages of a topic, which DDS keeps until somebody asks."""
    dds = {
        name: needed(f"cyclonedds.{name}", "ros2", _WHERE, SinkError)
        for name in ("core", "domain", "sub", "topic")
    }
    policy = dds["core"].Policy
    try:
        participant = dds["domain"].DomainParticipant(domain)
        about = dds["topic"].Topic(participant, f"rt/{topic}", struct_of(_KIND))
        qos = dds["core"].Qos(policy.Reliability.BestEffort, policy.History.KeepLast(_MOST))
        reader = dds["sub"].DataReader(participant, about, qos=qos)
    except dds["core"].DDSException as error:
        raise SinkError(f"cannot join domain {domain}: {error}", where=_WHERE) from error

    def take() -> Iterator[State]:
        while messages := reader.take(N=_AT_ONCE):
            for message in messages:
                if message.sample_info.valid_data:
                    yield 1e-9 * message.sample_info.source_timestamp, message

    return take


def _recorded(path: Path) -> Iterator[State]:
    """All joint states of a file, whatever their topic is called."""
    struct, some = struct_of(_KIND), False
    try:
        with path.open("rb") as file:
            for schema, _, message in make_reader(file).iter_messages():
                if schema is not None and schema.name == _KIND:
                    some = True
                    yield 1e-9 * message.log_time, struct.deserialize(message.data)
    except OSError as error:
        raise DataError(f"cannot be read: {error.strerror}", where=str(path)) from None
    except Exception as error:  # the libraries raise many kinds for damaged bytes
        raise DataError(f"is not a complete MCAP file: {error}", where=str(path)) from error
    if not some:
        raise DataError(f"expected messages of {_KIND}, got none", where=str(path))
