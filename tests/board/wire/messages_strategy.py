"""Any message of the schema, drawn field by field from the schema itself."""

from dataclasses import fields, replace

import numpy as np
from hypothesis import strategies as st

from tomoskin.board.wire import SCHEMA, Drive
from tomoskin.board.wire.messages import ENUMS, FRAMES, RECORDS
from tomoskin.core import DriveSamples, Frame

BITS = {"u8": 8, "u16": 16, "u32": 32, "u64": 64}


def _field(field):
    if field.enum and field.enum != "flag":
        return st.sampled_from(list(ENUMS[field.enum]))
    if field.item == "drive":
        drive = st.builds(
            Drive, st.integers(0, 255), st.integers(0, 255), st.integers(0, 2**32 - 1)
        )
        return st.lists(drive, max_size=9).map(tuple)
    if not field.length and field.item == "u8":
        return st.binary(max_size=55)
    if not field.length:
        counts = st.integers(0, 65535) | st.sampled_from([0, 1, 255, 256])
        return st.lists(counts, max_size=300).map(lambda c: np.array(c, dtype=np.uint16))
    if field.length > 1:
        return st.binary(min_size=field.length, max_size=field.length)
    return st.integers(0, 2 ** BITS[field.item] - 1)


def _message(spec):
    values = {field.name: _field(field) for field in spec.fields}
    if spec.name in FRAMES:
        values["host_time"] = st.just(0.0)
    if spec.name.endswith("_CHOPPED"):
        values["sums"] = values["samples"].map(lambda counts: counts[::-1])
        return st.builds(FRAMES[spec.name], **values).map(_as_long)
    return st.builds(RECORDS[spec.name], **values)


def _as_long(frame):
    """The frame with as many samples as sums."""
    n = min(len(frame.samples), len(frame.sums))
    return replace(frame, samples=frame.samples[:n], sums=frame.sums[:n])


def messages(to_device=None):
    """Strategy for messages, of one direction if asked."""
    chosen = [
        message
        for message in SCHEMA.messages
        if to_device in (None, message.to_device) and not message.name.endswith("_PACKED")
    ]
    return st.one_of([_message(spec) for spec in chosen])


def same(one, other):
    """Equality that looks into the samples of a frame."""
    if isinstance(one, Frame | DriveSamples) and type(one) is type(other):
        names = {field.name for field in fields(one)} - {"samples", "sums"}
        return (
            all(getattr(one, n) == getattr(other, n) for n in names)
            and np.array_equal(one.samples, other.samples)
            and np.array_equal(_sums(one), _sums(other))
        )
    return type(one) is type(other) and one == other


def _sums(frame):
    return [] if frame.sums is None else [1, *frame.sums.tolist()]
