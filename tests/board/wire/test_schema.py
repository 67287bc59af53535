"""The schema file: pinned by its hash, in step with the records and with the document."""

import dataclasses
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import pytest

from tomoskin.board.wire import ENUMS, OLDER, RECORDS, SCHEMA, BoardLimits, FaultCode, Info, Schema
from tomoskin.core import WireError

TEXT = files("tomoskin.board.wire").joinpath("protocol.toml").read_text(encoding="utf-8")

VERSIONS = {(1, 0): 0x8B6ABBBD, (1, 1): 0xF17AB758, (1, 2): 0x6B98E2FE}
"""Hash of each version that was ever published: a change of the schema needs a new version."""


def test_hash_of_this_version_is_the_published_one():
    assert {**OLDER, (SCHEMA.major, SCHEMA.minor): SCHEMA.hash} == VERSIONS


def test_hash_follows_what_is_on_the_wire_only():
    reworded = TEXT.replace("Ask for INFO", "Ask the board what it is")
    assert reworded != TEXT
    assert Schema.read(reworded).hash == SCHEMA.hash
    for old, new in [('type = "u64"', 'type = "u32"'), ("minor = 2", "minor = 3"), ("µs", "ms")]:
        assert Schema.read(TEXT.replace(old, new)).hash != SCHEMA.hash


def test_a_frame_has_what_its_messages_have():
    own = {field.name for field in dataclasses.fields(RECORDS["FRAME"])}
    for name in ("FRAME", "FRAME_PACKED", "FRAME_CHOPPED"):
        assert own - {field.name for field in SCHEMA.by_name[name].fields} == {"host_time", "sums"}


def test_records_and_values_are_the_schemas():
    info = Info(*range(15))
    assert [field.name for field in dataclasses.fields(info)] == [
        field.name for field in SCHEMA.by_name["INFO"].fields
    ]
    assert (Info.__name__, Info.__module__) == ("Info", "tomoskin.board.wire.messages")
    assert replace(info, channels=8).channels == 8
    with pytest.raises(dataclasses.FrozenInstanceError):
        info.channels = 8
    assert ENUMS["fault"] is FaultCode
    assert FaultCode(2) is FaultCode.WATCHDOG
    assert BoardLimits(0, b"A board\0\0", *range(6)).text == "A board"


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("type = 0x02", "type = 0x01", "share a type byte"),
        ('type = "u16[]"', 'type = "f32[]"', 'unknown type "f32[]"'),
        ('enum = "fault"', 'enum = "oops"', 'unknown enumeration "oops"'),
        (
            '"request", type = "u8", text = "request id of the GET',
            '"r", type = "u8[]", text = "',
            "last",
        ),
        ('type = "u8[3]"', 'type = "?"', "expected a type"),
    ],
)
def test_contradictions_are_named(old, new, said):
    assert old in TEXT
    with pytest.raises(WireError, match=said.replace("[", r"\[").replace("]", r"\]")):
        Schema.read(TEXT.replace(old, new))


def test_commands_fit_the_boards_receive_buffer():
    assert SCHEMA.to_device_bytes + 2 <= 64


def test_document_has_the_hash():
    document = (Path(__file__).parents[3] / "docs" / "protocol.md").read_text(encoding="utf-8")
    assert f"0x{SCHEMA.hash:08X}" in document
