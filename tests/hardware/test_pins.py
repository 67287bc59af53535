"""One table of pins makes header and connector; one that does not fit is refused."""

import shutil
import subprocess
import sys

import pytest

import pins

TABLE = pins.TABLE.read_text(encoding="utf-8")
HEADER = pins.HEADER.read_text(encoding="utf-8")
EMULATOR = pins.EMULATOR.read_text(encoding="utf-8")


def test_table_header_and_emulator_belong_together():
    assert pins.check(TABLE, HEADER, EMULATOR) == ""


@pytest.mark.parametrize(
    ("old", "new", "names"),
    [
        ('"PC4"', '"PL4"', ("hal_avr.c", "pins.toml", "SOURCE_ENABLE_0", "PC0", "PL4")),
        ('"PF3"', '"PF4"', ("POTENTIAL_3", "POTENTIAL_4", "PF4")),
        ('"PK7"', '"PL7"', ("hal_adc_start", "pins.toml", "POTENTIAL_15", "PK7", "PL7")),
        ('"PA3"', '"PA6"', ("hal_switches_address", "pins.toml", "SINK_ADDRESS_0", "PA6")),
        ('"PC0", "PC1"', '"PC1", "PC0"', ("pins.h", "pins.toml")),
        ('"PC4"', '"PZ4"', ("LATCH_0", "PZ4", "Arduino Mega 2560")),
        ('["PC4"]', "[]", ("pins.toml", "latch")),
        ('["PA0"', '["PC5"', ("SOURCE_ADDRESS", "pins.toml")),
    ],
)
def test_a_changed_table_is_refused_with_both_names(old, new, names):
    said = pins.check(TABLE.replace(old, new, 1), HEADER, EMULATOR)
    assert [name for name in names if name not in said] == []


def test_the_emulator_is_held_to_the_table():
    table = TABLE.replace('"PC0", "PC1"', '"PC1", "PC0"')
    said = pins.check(table, pins.header(pins.read(table)), EMULATOR)
    assert "emulator.c" in said
    assert "pins.toml" in said


def test_the_build_fails(tmp_path):
    for part in ("hardware/pins.toml", "hardware/pins.py", "firmware"):
        source, to = pins.ROOT / part, tmp_path / part
        if source.is_dir():
            shutil.copytree(source, to)
        else:
            to.parent.mkdir(exist_ok=True)
            shutil.copy(source, to)
    table = tmp_path / "hardware" / "pins.toml"
    table.write_text(TABLE.replace('"PC4"', '"PL4"'), encoding="utf-8")
    command = ["make", "-C", "firmware", "pins", f"PYTHON={sys.executable}"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode != 0
    assert "hal_avr.c" in done.stderr
    assert "pins.toml" in done.stderr
