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

from tomoskin.core import SinkError, SkinError, needed
from tomoskin.extras.ros2.joint_bag import JOINT_STATE, State, recorded_states, stamped
from tomoskin.extras.ros2.ros2_sink import ros_domain, struct_of
from tomoskin.run.sinks import options_of

MAX_AGE = 0.5
"""Seconds from a joint state after which it says no more how the robot stands."""

_LATE = 1.0
"""Seconds by which a message may come after a newer one; more, twice in turn: the clock was set."""

_TOPIC_OF_FILE = ":topic="
_WHERE = "joint states"
_MOST = 4000
"""Positions that are kept of each joint of a live robot: some seconds."""

_AT_ONCE = 64


@dataclass
class _Track:
    """Positions of one joint by their times, s since 1970, in order."""

    times: list[float] = field(default_factory=list)
    positions: list[float] = field(default_factory=list)
    _far: tuple[float, float] | None = None

    def add(self, time: float, position: float, most: int | None) -> None:
        """A late one goes to its place; two far before the last mean that the clock was set."""
        if self.times and time < self.times[-1] - _LATE:
            before, self._far = self._far, (time, position)
            if before is None:
                return
            self.times, self.positions = [before[0]], [before[1]]
        self._far = None
        place = bisect_right(self.times, time)
        self.times.insert(place, time)
        self.positions.insert(place, position)
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
        time = stamped(sent, message)
        for name, position in zip(message.name, message.position, strict=False):
            if math.isfinite(position):
                self._tracks.setdefault(name, _Track()).add(time, position, self._most)


def joint_states(spec: str) -> JointStates:
    """Of ``ros2``, ``ros2:domain=N,topic=NAME``, or the path of an MCAP file of ROS 2, perhaps with
    the topics in it that are meant: ``arm.mcap:topic=/arm/joint_states``.

    Raises
    ------
    SinkError
        Where there is no such topic or domain, or CycloneDDS is not installed.
    DataError
        When the file cannot be read, or does not say which joint states are meant.
    """
    name, _, argument = spec.partition(":")
    if name != "ros2":
        path, _, topics = spec.partition(_TOPIC_OF_FILE)
        taken, recorded = recorded_states(Path(path), filter(None, topics.split(",")))
        states = iter(recorded)  # the first who asks takes them all
        return JointStates(lambda: states, f"{path}, topic {taken}")
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
        about = dds["topic"].Topic(participant, f"rt/{topic}", struct_of(JOINT_STATE))
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
