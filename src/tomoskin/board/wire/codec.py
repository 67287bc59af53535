"""Payload ↔ message, driven by the schema."""

from __future__ import annotations

import dataclasses
import struct
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, TypeGuard

import numpy as np

from tomoskin.board.wire.framing import enclose
from tomoskin.board.wire.messages import (
    ENUMS,
    RECORDS,
    STRUCTS,
    ChoppedFrame,
    Command,
    Message,
    PackedFrame,
)
from tomoskin.board.wire.packing import packed_size_fits
from tomoskin.board.wire.schema import SCALARS, SCHEMA, FieldSpec, MessageSpec, Schema, StructSpec
from tomoskin.core import Frame, WireError

_DTYPES = {"u8": "<u1", "u16": "<u2"}
"""Of the samples of a frame."""

_NOT_SENT = ("host_time", "sums")
"""Fields of a frame that are not on the wire as such: the host's own time of reading, and what
:class:`ChoppedFrame` has among its samples."""


@dataclass(frozen=True)
class Layout:
    """How one message lies in its payload, worked out once from the schema.

    ``head`` packs the type byte and every field but the tail; ``tail`` is the
    :mod:`struct` layout of one item of the field that fills the rest, if there is one.
    """

    spec: MessageSpec
    record: type[Message]
    head: struct.Struct
    names: tuple[str, ...]
    enums: tuple[tuple[int, Callable[[int], Any]], ...]
    tail: struct.Struct | None
    tail_record: type[Any] | None


def _layout(spec: MessageSpec, structs: dict[str, StructSpec]) -> Layout:
    record = RECORDS[spec.name]
    names = tuple(field.name for field in spec.fields)
    own = tuple(f.name for f in dataclasses.fields(record) if f.name not in _NOT_SENT)
    if own != names:
        raise WireError(f"expected the schema's fields {names}, got {own}", where=record.__name__)
    fixed = [field for field in spec.fields if not field.is_tail]
    tail = next((field for field in spec.fields if field.is_tail), None)
    enums = tuple(
        (number, ENUMS[field.enum])
        for number, field in enumerate(fixed, start=1)
        if field.enum and field.enum != "flag"
    )
    return Layout(
        spec, record, struct.Struct("<B" + "".join(map(_code, fixed))), names, enums,
        struct.Struct("<" + _item(tail, structs)) if tail else None,
        STRUCTS.get(tail.item) if tail else None,
    )  # fmt: skip


def _code(field: FieldSpec) -> str:
    return SCALARS[field.item] if field.length == 1 else f"{field.length}s"


def _item(field: FieldSpec, structs: dict[str, StructSpec]) -> str:
    if field.item in SCALARS:
        return SCALARS[field.item]
    return "".join(_code(part) for part in structs[field.item].fields)


def _layouts(schema: Schema) -> tuple[dict[int, Layout], dict[type[Message], Layout]]:
    layouts = [_layout(spec, schema.structs) for spec in schema.messages]
    return {x.spec.type: x for x in layouts}, {x.record: x for x in layouts}


_BY_TYPE, _BY_RECORD = _layouts(SCHEMA)


def type_byte(record: type[Message]) -> int:
    """The type byte of a message."""
    return _BY_RECORD[record].spec.type


def encode(message: Message) -> bytes:
    """The bytes on the line for ``message``; WireError when a value does not fit its field."""
    payload = encode_payload(message)
    to_device = _BY_RECORD[type(message)].spec.to_device
    limit = SCHEMA.to_device_bytes if to_device else SCHEMA.from_device_bytes
    if len(payload) + 2 > limit:
        raise WireError(
            f"expected at most {limit} bytes with the checksum, got {len(payload) + 2}",
            where=_BY_RECORD[type(message)].spec.name,
        )
    return enclose(payload)


def encode_payload(message: Message) -> bytes:
    """Type byte and fields, without checksum."""
    layout = _BY_RECORD[type(message)]
    values = [getattr(message, name) for name in layout.names]
    try:
        if layout.tail is None:
            return layout.head.pack(layout.spec.type, *values)
        return layout.head.pack(layout.spec.type, *values[:-1]) + _pack_tail(layout, values[-1])
    except struct.error as error:
        raise WireError(f"{error} in {message!r}", where=layout.spec.name) from error


def _pack_tail(layout: Layout, items: Any) -> bytes:
    if layout.tail_record is None:
        samples, expected = np.asarray(items), np.dtype(_DTYPES[layout.spec.fields[-1].item])
        if samples.dtype != expected or samples.ndim != 1:
            raise WireError(
                f"expected samples (n,) of {expected}, got {samples.shape} of {samples.dtype}",
                where=layout.spec.name,
            )
        return samples.tobytes()
    assert layout.tail is not None
    return b"".join(layout.tail.pack(*dataclasses.astuple(item)) for item in items)


def decode_payload(payload: bytes, host_time: float) -> Message | None:
    """The message in a payload whose checksum was right; None when it is not of this schema.

    Packed and chopped frames come out as frames.
    """
    layout = _BY_TYPE.get(payload[0]) if payload else None
    if layout is None or not _fits(layout, len(payload)):
        return None
    values: list[Any] = list(layout.head.unpack_from(payload))
    try:
        for number, enum in layout.enums:
            values[number] = enum(values[number])
    except ValueError:
        return None
    if layout.tail is None:
        return layout.record(*values[1:])
    if layout.record in _FRAMES:
        return _FRAMES[layout.record](values, payload, layout.head.size, host_time)
    record = layout.tail_record
    assert record is not None
    items = tuple(record(*item) for item in layout.tail.iter_unpack(payload[layout.head.size :]))
    return layout.record(*values[1:], items)  # type: ignore[call-arg]


def _fits(layout: Layout, length: int) -> bool:
    rest = length - layout.head.size
    return rest >= 0 and (rest % layout.tail.size == 0 if layout.tail else rest == 0)


def _frame(values: list[Any], payload: bytes, size: int, host_time: float) -> Frame:
    sequence, ticks, configuration, flags, drops = values[1:]
    samples = np.frombuffer(payload, dtype="<u2", offset=size)
    return Frame(sequence, ticks, host_time, configuration, flags, drops, samples)


def _packed_frame(values: list[Any], payload: bytes, size: int, host_time: float) -> Frame | None:
    if not packed_size_fits(len(payload) - size):
        return None
    sequence, ticks, configuration, flags, drops = values[1:]
    packed = np.frombuffer(payload, dtype=np.uint8, offset=size)
    return PackedFrame(sequence, ticks, host_time, configuration, flags, drops, packed).frame


def _chopped_frame(values: list[Any], payload: bytes, size: int, host_time: float) -> Frame | None:
    frame = _frame(values, payload, size, host_time)
    if len(frame.samples) % 2:
        return None
    return replace(frame, samples=frame.samples[::2], sums=frame.samples[1::2])


_FRAMES: dict[type[Message], Callable[[list[Any], bytes, int, float], Frame | None]] = {
    Frame: _frame,
    PackedFrame: _packed_frame,
    ChoppedFrame: _chopped_frame,
}
"""How the samples of each kind of frame are read."""


def is_command(message: Message) -> TypeGuard[Command]:
    """Whether ``message`` goes to the device."""
    return _BY_RECORD[type(message)].spec.to_device
