"""Payload ↔ message, driven by the schema; a stream of bytes, however torn or dirty, → messages."""

from __future__ import annotations

import dataclasses
import struct
from collections.abc import Callable
from dataclasses import dataclass
from itertools import starmap
from typing import Any, TypeGuard

import numpy as np
from numpy.typing import NDArray

from tomoskin.board.wire.framing import Deframer, enclose
from tomoskin.board.wire.messages import ENUMS, FRAMES, RECORDS, STRUCTS, Command, Message
from tomoskin.board.wire.schema import SCALARS, SCHEMA, FieldSpec, MessageSpec
from tomoskin.core import DriveSamples, Frame, WireError

_GROUP = 4
"""Samples of ten bits that are packed together: four lower bytes, then their upper halves."""

_SHIFTS = np.array([0, 2, 4, 6], dtype=np.uint8)


@dataclass(frozen=True)
class _Layout:
    """How one message lies in its payload, worked out once from the schema.

    ``head`` packs the type byte and every field but the tail; ``tail`` is the
    :mod:`struct` layout of one item of the field that fills the rest, if there is one.
    """

    spec: MessageSpec
    head: struct.Struct
    enums: tuple[tuple[int, Callable[[int], Any]], ...]
    tail: struct.Struct | None
    tail_record: type[Any] | None

    @classmethod
    def of(cls, spec: MessageSpec) -> _Layout:
        fixed = [field for field in spec.fields if field.length]
        tail = next((field for field in spec.fields if not field.length), None)
        enums = (
            (number, ENUMS[field.enum])
            for number, field in enumerate(fixed, start=1)
            if field.enum and field.enum != "flag"
        )
        return cls(
            spec, struct.Struct("<B" + "".join(map(_code, fixed))), tuple(enums),
            struct.Struct("<" + _item(tail)) if tail else None,
            STRUCTS.get(tail.item) if tail else None,
        )  # fmt: skip


def _code(field: FieldSpec) -> str:
    return SCALARS[field.item] if field.length == 1 else f"{field.length}s"


def _item(field: FieldSpec) -> str:
    if field.item in SCALARS:
        return SCALARS[field.item]
    return "".join(_code(part) for part in SCHEMA.structs[field.item].fields)


_LAYOUTS = {spec.name: _Layout.of(spec) for spec in SCHEMA.messages}
_BY_TYPE = {layout.spec.type: layout for layout in _LAYOUTS.values()}
_BY_RECORD = {RECORDS[name]: layout for name, layout in _LAYOUTS.items() if name not in FRAMES}


def type_byte(record: type[Command]) -> int:
    """The byte that names this type of command on the wire."""
    return _BY_RECORD[record].spec.type


def encode(message: Message, *, packed: bool = False) -> bytes:
    """The bytes on the line for ``message``; a frame's samples may be ``packed``.

    Raises WireError when a value does not fit its field, or all do not fit a message.
    """
    payload = encode_payload(message, packed=packed)
    spec = _BY_TYPE[payload[0]].spec
    limit = SCHEMA.to_device_bytes if spec.to_device else SCHEMA.from_device_bytes
    if len(payload) + 2 > limit:
        raise WireError(
            f"expected at most {limit} bytes with the checksum, got {len(payload) + 2}",
            where=spec.name,
        )
    return enclose(payload)


def encode_payload(message: Message, *, packed: bool = False) -> bytes:
    """Type byte and fields, without checksum."""
    if isinstance(message, Frame | DriveSamples):
        layout, tail = _samples(message, packed=packed)
        values = tuple(getattr(message, field.name) for field in layout.spec.fields[:-1])
    else:
        layout, values, tail = _BY_RECORD[type(message)], dataclasses.astuple(message), b""
    try:
        if layout.tail is not None and not isinstance(message, Frame | DriveSamples):
            values, items = values[:-1], values[-1]
            records = layout.tail_record is not None
            tail = b"".join(starmap(layout.tail.pack, items)) if records else items
        return layout.head.pack(layout.spec.type, *values) + tail
    except struct.error as error:
        raise WireError(f"{error} in {message!r}", where=layout.spec.name) from error


def _samples(frame: Frame | DriveSamples, *, packed: bool) -> tuple[_Layout, bytes]:
    """The message that samples go in, and these as they are sent."""
    samples, name = frame.samples, "FRAME" if isinstance(frame, Frame) else "DRIVE_SAMPLES"
    if samples.dtype != np.dtype("<u2") or samples.ndim != 1:
        raise WireError(
            f"expected samples (n,) of uint16, got {samples.shape} of {samples.dtype}",
            where=name,
        )
    if frame.sums is not None:
        both = np.column_stack([samples, frame.sums]).astype("<u2")
        return _LAYOUTS[f"{name}_CHOPPED"], both.tobytes()
    if packed:
        return _LAYOUTS[f"{name}_PACKED"], pack(samples).tobytes()
    return _LAYOUTS[name], samples.tobytes()


def decode_payload(payload: bytes, host_time: float) -> Message | None:
    """The message in a payload whose checksum was right; None when it is not of this schema."""
    layout = _BY_TYPE.get(payload[0]) if payload else None
    if layout is None or not _fits(layout, len(payload)):
        return None
    size, name = layout.head.size, layout.spec.name
    values: list[Any] = list(layout.head.unpack_from(payload))
    try:
        for number, enum in layout.enums:
            values[number] = enum(values[number])
    except ValueError:
        return None
    if name in FRAMES:
        return _frame(name, values, np.frombuffer(payload, np.uint8, offset=size), host_time)
    if layout.tail is not None:
        record, rest = layout.tail_record, payload[size:]
        values.append(tuple(record(*i) for i in layout.tail.iter_unpack(rest)) if record else rest)
    made: Message = RECORDS[name](*values[1:])
    return made


def _fits(layout: _Layout, length: int) -> bool:
    rest = length - layout.head.size
    return rest >= 0 and (rest % layout.tail.size == 0 if layout.tail else rest == 0)


def _frame(
    name: str, values: list[Any], data: NDArray[np.uint8], host_time: float
) -> Frame | DriveSamples | None:
    """A frame or drive of the samples in ``data``; None where so many bytes hold no samples."""
    _, sequence, ticks, *rest = values
    if name.endswith("_PACKED"):
        if len(data) % (_GROUP + 1) == 1:
            return None
        samples = unpack(data)
    else:
        samples = data.view("<u2")
    values = [sequence, ticks, host_time, *rest, samples]
    if name.endswith("_CHOPPED"):
        if len(samples) % 2:
            return None
        values[-1:] = samples[::2], samples[1::2]
    made: Frame | DriveSamples = FRAMES[name](*values)
    return made


def is_command(message: Message) -> TypeGuard[Command]:
    """Whether ``message`` goes to the device."""
    layout = _BY_RECORD.get(type(message))
    return layout is not None and layout.spec.to_device


class Decoder:
    """Bytes from a device → its messages.

    Whatever is torn, corrupt, foreign or endless is dropped up to the next 0x00 and counted;
    memory is bounded by one message, and no input raises.

    Attributes
    ----------
    counters
        What the stream has held until now.
    """

    def __init__(self) -> None:
        """A decoder at the start of a stream."""
        self._deframer = Deframer(SCHEMA.from_device_bytes)
        self.counters = self._deframer.counters

    def feed(self, data: bytes, host_time: float) -> list[Message]:
        """Messages that ``data`` completes; frames carry ``host_time`` (monotonic s)."""
        messages = []
        for payload in self._deframer.feed(data):
            message = decode_payload(payload, host_time)
            if message is None or is_command(message):
                self._deframer.drop("foreign")
            else:
                messages.append(message)
        self.counters.messages += len(messages)
        return messages

    def forget(self) -> None:
        """The stream goes on elsewhere: a message under way is given up, the counts stay."""
        self._deframer.forget()


def pack(samples: NDArray[np.uint16]) -> NDArray[np.uint8]:
    """(n + ⌈n/4⌉,) uint8 for (n,) samples below 1,024."""
    n = len(samples)
    padded = np.zeros(-(-n // _GROUP) * _GROUP, dtype=np.uint16)
    padded[:n] = samples
    groups = padded.reshape(-1, _GROUP)
    upper = np.bitwise_or.reduce((groups >> 8) << _SHIFTS, axis=1)
    packed = np.column_stack([groups & 0xFF, upper]).astype(np.uint8).ravel()
    return packed if n % _GROUP == 0 else np.append(packed[: n + n // _GROUP], packed[-1])


def unpack(packed: NDArray[np.uint8]) -> NDArray[np.uint16]:
    """(n,) samples of (n + ⌈n/4⌉,) bytes."""
    n_groups = len(packed) // (_GROUP + 1)
    groups = packed[: n_groups * (_GROUP + 1)].reshape(n_groups, _GROUP + 1)
    samples = _join(groups[:, :_GROUP], groups[:, _GROUP:]).ravel()
    rest = packed[n_groups * (_GROUP + 1) :]
    return np.append(samples, _join(rest[:-1], rest[-1:])) if len(rest) else samples


def _join(lower: NDArray[np.uint8], upper: NDArray[np.uint8]) -> NDArray[np.uint16]:
    high = (upper >> _SHIFTS[: lower.shape[-1]] & 3).astype(np.uint16)
    joined: NDArray[np.uint16] = np.left_shift(high, 8, dtype=np.uint16) | lower
    return joined
