"""The messages as frozen records, made of the schema; ``messages.pyi`` says the same to a reader.

``scripts/firmware_header.py`` writes that file. A field u8[n] is bytes; samples, packed or
not, are a :class:`Frame` or :class:`DriveSamples`, which also know when the host read them.
"""

from __future__ import annotations

from dataclasses import make_dataclass
from enum import Enum, IntEnum, IntFlag
from functools import reduce
from operator import or_
from typing import Any

from tomoskin.board.wire.schema import SCALARS, SCHEMA, FieldSpec
from tomoskin.core import DriveSamples, Frame

FRAMES: dict[str, type] = {
    f"{name}{form}": record
    for name, record in (("FRAME", Frame), ("DRIVE_SAMPLES", DriveSamples))
    for form in ("", "_PACKED", "_CHOPPED")
}
"""Messages that hold samples, and the records that they become."""

_NAMES = {
    "SCAN": "HeldScan",
    "PATTERN": "HeldPattern",
    "MODE": "HeldMode",
    "BOARD": "BoardLimits",
    "fault": "FaultCode",
    "flag": "FrameFlag",
}
"""What the class of a message or of an enumeration is called, where that is not its own name."""


class Named:
    """A record with a name of fixed length, filled up with zeros."""

    __slots__ = ()

    name: bytes

    @property
    def text(self) -> str:
        """The name as text, without its filling zeros."""
        return self.name.rstrip(b"\0").decode(errors="replace")


def class_name(name: str) -> str:
    """What the class of a message, group or enumeration of the schema is called."""
    return _NAMES.get(name, name.title().replace("_", ""))


def _enumeration(name: str) -> type[Enum]:
    members = [(one.name, one.value) for one in SCHEMA.enums[name].values]
    kind = IntFlag if name == "flag" else IntEnum
    made: type[Enum] = kind(class_name(name), members, module=__name__)  # type: ignore[arg-type]
    return made


ENUMS = {name: _enumeration(name) for name in SCHEMA.enums}
"""Each enumeration by its name in the schema."""


def _record(name: str, text: str, fields: tuple[FieldSpec, ...]) -> type:
    bases = (Named,) if any(field.name == "name" for field in fields) else ()
    typed = [(field.name, _type(field)) for field in fields]
    made = make_dataclass(class_name(name), typed, bases=bases, frozen=True, slots=True)
    made.__module__, made.__doc__ = __name__, f"{text}."
    return made


def _type(field: FieldSpec) -> Any:
    if field.item not in SCALARS:
        return tuple[STRUCTS[field.item], ...]  # type: ignore[misc]
    return ENUMS[field.enum] if field.enum else int if field.length == 1 else bytes


STRUCTS: dict[str, type] = {}
for _name, _group in SCHEMA.structs.items():
    STRUCTS[_name] = _record(_name, _group.text, _group.fields)

RECORDS: dict[str, type] = {
    message.name: FRAMES.get(message.name) or _record(message.name, message.text, message.fields)
    for message in SCHEMA.messages
}
"""The record of each message by its name in the schema."""

Command: Any = reduce(or_, [RECORDS[m.name] for m in SCHEMA.messages if m.to_device])
Message: Any = reduce(or_, RECORDS.values())

globals().update({one.__name__: one for one in (*STRUCTS.values(), *RECORDS.values())})
globals().update({one.__name__: one for one in ENUMS.values()})
