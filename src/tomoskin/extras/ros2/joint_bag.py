"""Joint states in a bag of ROS 2 (MCAP): which of its topics says how the robot stands."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import IO, Any

import zstandard  # mcap needs it too
from mcap.reader import make_reader

from tomoskin.core import DataError
from tomoskin.extras.ros2.ros2_sink import struct_of

JOINT_STATE = "sensor_msgs/msg/JointState"

State = tuple[float, Any]
"""A message, and when it was sent: s since 1970, for messages that do not say."""

_TOPIC = "/joint_states"
"""Where drivers of robots publish the positions that are measured."""

_ZSTD = b"\x28\xb5\x2f\xfd"
_CDR_HEAD = 4
_LONGEST = 1 << 24
"""A message has at most so many bytes: more is no joint state."""


def stamped(sent: float, message: Any) -> float:
    """When a state was measured, s since 1970: its header's stamp, or when it was sent."""
    stamp = message.header.stamp
    return float(stamp.sec + 1e-9 * stamp.nanosec or sent)


def recorded_states(path: Path, topics: Iterable[str] = ()) -> tuple[str, list[State]]:
    """The topics that were taken, and their messages in the order of their stamps.

    Without ``topics`` these are /joint_states, else what is called so below one namespace, else the
    only ones that there are. The file may be compressed as a whole, or its messages one by one.

    Raises
    ------
    DataError
        When the file cannot be read, holds no joint states, or several topics of which none is
        named: one may be a controller's targets.
    """
    try:
        with path.open("rb") as file:
            messages = _messages(file)
    except OSError as error:
        raise DataError(f"cannot be read: {error.strerror}", where=str(path)) from None
    except Exception as error:  # the libraries raise many kinds for damaged bytes
        raise DataError(f"is not a complete MCAP file: {error}", where=str(path)) from error
    if not messages:
        raise DataError(f"expected messages of {JOINT_STATE}, got none", where=str(path))
    chosen = _chosen([*topics], messages, path)
    states = [
        state for topic in chosen for state in _decoded(messages[topic], f"{path}, topic {topic}")
    ]
    return ", ".join(chosen), sorted(states, key=lambda state: stamped(*state))


def _messages(file: IO[bytes]) -> dict[str, list[tuple[float, bytes]]]:
    """When each was written, s since 1970, and its bytes, by topics."""
    is_packed = file.read(len(_ZSTD)) == _ZSTD
    file.seek(0)
    stream: Any = file
    if is_packed:
        stream = zstandard.ZstdDecompressor().stream_reader(file, read_across_frames=True)
    messages: dict[str, list[tuple[float, bytes]]] = {}
    for schema, channel, message in make_reader(stream).iter_messages(log_time_order=False):
        if schema is not None and schema.name == JOINT_STATE:
            of_topic = messages.setdefault(channel.topic, [])
            of_topic.append((1e-9 * message.log_time, message.data))
    return messages


def _chosen(asked: list[str], messages: Mapping[str, Any], path: Path) -> list[str]:
    known = sorted(messages)
    if unknown := [topic for topic in asked if topic not in messages]:
        raise DataError(
            f"expected joint states of the topics {', '.join(known)}, got {', '.join(unknown)}",
            where=str(path),
        )
    if asked:
        return asked
    usual = [topic for topic in known if topic.endswith(_TOPIC)]
    if _TOPIC in usual:
        return [_TOPIC]
    if len(usual or known) == 1:
        return usual or known
    raise DataError(
        f"expected one topic of joint states, got {', '.join(known)}",
        where=str(path),
        hint="one may hold targets, not positions: name the measured one, "
        f'as in joints = "{path.name}:topic={(usual or known)[0]}"',
    )


def _decoded(messages: Iterable[tuple[float, bytes]], where: str) -> Iterator[State]:
    struct = struct_of(JOINT_STATE)
    for number, (sent, data) in enumerate(messages):
        try:
            yield sent, struct.deserialize(_plain(data))
        except Exception as error:  # of any kind, for damaged bytes
            raise DataError(
                f"expected a {JOINT_STATE}, got what cannot be decoded: {error}",
                where=f"{where}, message {number}",
                hint="ros2 bag convert writes a bag without compression",
            ) from error


def _plain(data: bytes) -> bytes:
    """Of a message that may be compressed, as ``ros2 bag record --compression-mode message`` does;
    CDR begins with its kind, below 16."""
    if data.startswith(_ZSTD):
        with zstandard.ZstdDecompressor().stream_reader(data) as stream:
            data = stream.read(_LONGEST)
    if len(data) < _CDR_HEAD or data[0] or data[1] >= 16:
        raise ValueError(f"expected CDR, got bytes that begin with {data[:4].hex(' ')}")
    return data
