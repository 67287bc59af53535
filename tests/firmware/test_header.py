"""The firmware's header is that of the schema."""

import importlib.util
import re

import pytest

from firmware.boards import FIRMWARE, ROOT
from tomoskin.board.wire import SCHEMA


@pytest.fixture(scope="module")
def script():
    spec = importlib.util.spec_from_file_location("header", ROOT / "scripts/firmware_header.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_header_is_not_stale(script):
    assert (FIRMWARE / "src" / "protocol.h").read_text(encoding="utf-8") == script.header(SCHEMA)


def test_the_types_of_the_records_are_not_stale(script):
    assert script.STUB.read_text(encoding="utf-8") == script.stub(SCHEMA)


def test_it_holds_the_hash_and_every_message(script):
    made = script.header(SCHEMA)
    assert f"PROTOCOL_HASH UINT32_C(0x{SCHEMA.hash:08X})" in made
    for message in SCHEMA.messages:
        assert re.search(rf"#define MSG_{message.name} 0x{message.type:02X}u\n", made)
    assert "#define AT_SET_SCAN_PRESCALER 13u\n" in made
    assert "#define FIELD_SET_SCAN_PRESCALER 6u\n" in made
    assert "#define SIZE_DRIVE 6u\n" in made
    assert "#define SIZE_FRAME 18u\n" in made


def test_check_says_stale(script, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(script, "HEADER", tmp_path / "protocol.h")
    monkeypatch.setattr(script, "STUB", tmp_path / "messages.pyi")
    for file in (script.HEADER, script.STUB):
        file.write_text("old", encoding="utf-8")
    monkeypatch.setattr("sys.argv", ["firmware_header.py", "--check"])
    assert script.main() == 1
    assert "stale" in capsys.readouterr().err
    monkeypatch.setattr("sys.argv", ["firmware_header.py"])
    assert script.main() == 0
    monkeypatch.setattr("sys.argv", ["firmware_header.py", "--check"])
    assert script.main() == 0
