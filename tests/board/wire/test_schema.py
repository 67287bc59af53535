"""The schema file: pinned by its hash, in step with the records and with the document."""

import dataclasses
import re
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import pytest

from tomoskin.board.wire import OLDER, SCHEMA, BoardLimits, FaultCode, Info, Schema
from tomoskin.board.wire.messages import ENUMS, FRAMES, RECORDS
from tomoskin.board.wire.schema import SCALARS

TEXT = files("tomoskin.board.wire").joinpath("protocol.toml").read_text(encoding="utf-8")

VERSIONS = {
    (1, 0): 0x8B6ABBBD,
    (1, 1): 0xF17AB758,
    (1, 2): 0x6B98E2FE,
    (1, 3): 0xFFDB1F25,
    (1, 4): 0x2CE45792,
}
"""Hash of each version that was ever published: a change of the schema needs a new version."""


def test_hash_of_this_version_is_the_published_one():
    assert {**OLDER, (SCHEMA.major, SCHEMA.minor): SCHEMA.hash} == VERSIONS


def test_hash_follows_what_is_on_the_wire_only():
    reworded = TEXT.replace("Ask for INFO", "Ask the board what it is")
    assert reworded != TEXT
    assert Schema.read(reworded).hash == SCHEMA.hash
    for old, new in [('type = "u64"', 'type = "u32"'), ("minor = 4", "minor = 5"), ("µs", "ms")]:
        assert Schema.read(TEXT.replace(old, new)).hash != SCHEMA.hash


def names_of(message: str) -> list[str]:
    fields = next(one.fields for one in SCHEMA.messages if one.name == message)
    return [field.name for field in fields]


def test_a_frame_and_a_drive_have_what_their_messages_have():
    for name, record in FRAMES.items():
        own = {field.name for field in dataclasses.fields(record)}
        assert own - set(names_of(name)) == {"host_time", "sums"}
        assert RECORDS[name] is record


def test_records_and_values_are_the_schemas():
    info = Info(*range(15))
    assert [field.name for field in dataclasses.fields(info)] == names_of("INFO")
    assert (Info.__name__, Info.__module__) == ("Info", "tomoskin.board.wire.messages")
    assert replace(info, channels=8).channels == 8
    with pytest.raises(dataclasses.FrozenInstanceError):
        info.channels = 8
    assert ENUMS["fault"] is FaultCode
    assert FaultCode(2) is FaultCode.WATCHDOG
    assert BoardLimits(0, b"A board\0\0", *range(6)).text == "A board"


def test_the_schema_does_not_contradict_itself():
    assert len({message.type for message in SCHEMA.messages}) == len(SCHEMA.messages)
    assert len({message.name for message in SCHEMA.messages}) == len(SCHEMA.messages)
    groups = [(m.name, m.fields) for m in SCHEMA.messages]
    groups += [(name, one.fields) for name, one in SCHEMA.structs.items()]
    for name, fields in groups:
        assert not any(not field.length for field in fields[:-1]), name
        for field in fields:
            assert field.item in SCALARS or (not field.length and field.item in SCHEMA.structs), (
                name
            )
            assert not field.enum or field.enum in SCHEMA.enums, name
            assert re.fullmatch(r"\w+(\[\d*\])?", field.type_name), name


def test_commands_fit_the_boards_receive_buffer():
    assert SCHEMA.to_device_bytes + 2 <= 64


def test_document_has_the_hash():
    document = (Path(__file__).parents[3] / "docs" / "protocol.md").read_text(encoding="utf-8")
    assert f"0x{SCHEMA.hash:08X}" in document
