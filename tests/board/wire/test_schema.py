"""The schema file: pinned by its hash, in step with the records and with the document."""

import dataclasses
from importlib.resources import files
from pathlib import Path

import pytest

from tomoskin.board.wire import ENUMS, OLDER, RECORDS, SCHEMA, SCHEMA_HASH, Schema, schema_tables
from tomoskin.core import WireError

TEXT = files("tomoskin.board.wire").joinpath("protocol.toml").read_text(encoding="utf-8")

VERSIONS = {(1, 0): 0x8B6ABBBD, (1, 1): 0xF17AB758, (1, 2): 0x6B98E2FE}
"""Hash of each version that was ever published: a change of the schema needs a new version."""


def test_hash_of_this_version_is_the_published_one():
    assert {**OLDER, (SCHEMA.major, SCHEMA.minor): SCHEMA_HASH} == VERSIONS


def test_hash_follows_what_is_on_the_wire_only():
    reworded = TEXT.replace("Ask for INFO", "Ask the board what it is")
    assert reworded != TEXT
    assert Schema.read(reworded).hash == SCHEMA_HASH
    for old, new in [('type = "u64"', 'type = "u32"'), ("minor = 2", "minor = 3"), ("µs", "ms")]:
        assert Schema.read(TEXT.replace(old, new)).hash != SCHEMA_HASH


def test_every_message_and_enum_has_its_record():
    assert set(RECORDS) == {message.name for message in SCHEMA.messages}
    for message in SCHEMA.messages:
        own = [
            f.name
            for f in dataclasses.fields(RECORDS[message.name])
            if f.name not in ("host_time", "sums")
        ]
        assert own == [field.name for field in message.fields]
    for name, enum in SCHEMA.enums.items():
        assert {member.name: member.value for member in ENUMS[name]} == {
            key: value for key, value, _ in enum.values
        }


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


def test_document_is_in_step_with_the_schema():
    document = (Path(__file__).parents[3] / "docs" / "protocol.md").read_text(encoding="utf-8")
    assert schema_tables(SCHEMA) in document
    assert f"0x{SCHEMA_HASH:08X}" in document
