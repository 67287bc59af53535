"""Some seconds of what ``make fuzz`` does for long: libFuzzer on the parser and the USB part."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest

from firmware.boards import FIRMWARE, make
from firmware.conftest import need

USB_MUTANTS = {
    "a message's order of packets": (
        "    sending.pid ^= USB_DATA1;\n    sending.occ",
        "    sending.occ",
    ),
    "packets longer than they may be": (
        "sending.left < PACKET ? sending.left : PACKET",
        "sending.left",
    ),
    "an answer longer than was asked for": (
        "control.left = size < setup->length ? size : setup->length;",
        "control.left = size;",
    ),
    "no end of a full last packet": ("sending.left == 0u && size == PACKET", "false"),
    "an address that outlives a reset": ("    REGISTER(USB_ADDR) = 0u;\n", ""),
    "a device that listens once": ("        listen();\n        hal_unlock", "        hal_unlock"),
    "suspended for ever": (
        "REGISTER(USB_SIE_STATUS) = USB_RESUMED;\n        suspended",
        "(void)0;\n        bool suspended",
    ),
    "a halt cleared, and the toggle kept": (
        "*pid = 0u;\n    if",
        "if",
    ),
    "a halt cleared, and the packet that waits kept": (
        "give(buffer, held & ~(USB_AVAILABLE | USB_DATA1));",
        "",
    ),
    "data where there are none": ("(setup->kind & TO_HOST) != 0u", "true"),
}


@pytest.fixture(scope="module", autouse=True)
def clang() -> None:
    makefile = (FIRMWARE / "Makefile").read_text(encoding="utf-8")
    found = re.search(r"for c in ([\w -]+);", makefile)
    assert found is not None
    need([next(filter(shutil.which, found[1].split()), "clang")], "clang libclang-rt-14-dev")


@pytest.mark.parametrize("what", ["fuzz", "fuzz-usb"])
def test_mutated_streams_break_nothing(what: str) -> None:
    made = make(what, "RUNS=5000")
    assert made.returncode == 0, made.stderr[-2000:]


@pytest.mark.slow
@pytest.mark.parametrize("name", USB_MUTANTS)
def test_a_mutant_of_the_usb_part_is_noticed(name: str, tmp_path: Path) -> None:
    old, new = USB_MUTANTS[name]
    copy = tmp_path / "firmware"
    shutil.copytree(FIRMWARE, copy, ignore=shutil.ignore_patterns("node_modules"))
    source = copy / "pico" / "usb.c"
    text = source.read_text(encoding="utf-8")
    assert text.count(old) == 1, f"{old} is gone or not the only one"
    source.write_text(text.replace(old, new), encoding="utf-8")
    made = make("fuzz-usb", f"BUILD={tmp_path}", "RUNS=20000", folder=copy)
    assert made.returncode != 0
    assert "error: " not in made.stderr.partition("INFO: Running")[0]
