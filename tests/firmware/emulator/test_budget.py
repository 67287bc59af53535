"""What the ELF takes of its processor and memory, by the emulator's own count."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from firmware.boards import running
from firmware.emulator.test_emulator import frames_of
from firmware.emulator.watch import CLOCK, Watch, symbol
from tomoskin.board.source import Link, ScanSettings, SerialTransport
from tomoskin.model.pattern import Pattern, Scan
from tomoskin_emulator.program import Programs

MOST_FLASH, MOST_RAM, MEMORY = 16 * 1024, 4 * 1024, 8 * 1024
MOST_STACK = 256
TWO_BYTES = 20e-6
"""s at 1 MBd: the processor holds two and the one that is coming; simavr holds more."""

# Electrodes, conversions summed (one: packed), most cycles to enclose a frame.
ENCLOSED = [(8, 1, 5_000), (8, 4, 5_000), (16, 1, 7_500), (16, 4, 13_000)]


def test_the_firmware_is_small(programs: Programs) -> None:
    lines = subprocess.run(["avr-size", programs.elf], capture_output=True, text=True, check=True)
    text, data, bss = map(int, lines.stdout.splitlines()[1].split()[:3])
    assert text + data < MOST_FLASH
    assert data + bss < MOST_RAM
    assert data + bss + 4 * MOST_STACK < MEMORY


@pytest.mark.parametrize(("electrodes", "oversampling", "most"), ENCLOSED)
def test_cycles_to_enclose_a_frame_and_the_stack(
    programs: Programs, tmp_path: Path, electrodes: int, oversampling: int, most: int
) -> None:
    scan = Scan.of(Pattern.adjacent(electrodes))
    settings = ScanSettings(oversampling, 200e-6, current_limit=0.1, adc_bits=10)
    watch, elf = tmp_path / "watch", programs.elf
    with (
        running(programs.emulator, tmp_path / "port", "-f", "-w", str(watch), str(elf)) as board,
        Link(SerialTransport(board.path), scan, settings) as link,
    ):
        frames_of(link, 3)
        before = Watch.read(watch)
        frames_of(link, 200)
        after = Watch.read(watch)
    start, _ = symbol(elf, "framing_enclose")
    calls = int(after.spent[start // 2] - before.spent[start // 2]) / 2  # it begins with a push
    function = after.cycles_in(elf, "framing_enclose") - before.cycles_in(elf, "framing_enclose")
    shifts = after.cycles_in(elf, "memmove") - before.cycles_in(elf, "memmove")
    assert calls > 10
    assert 1_000 < (function + shifts) / calls < most
    assert 30 < after.stack < MOST_STACK


@pytest.mark.parametrize(
    ("electrodes", "settings"),
    [
        (8, ScanSettings(1, 200e-6, 0.1, 10)),
        (16, ScanSettings(4, 200e-6, 0.1, 10, dead_time=50e-6)),
        (8, ScanSettings(16, 200e-6, 0.1, 10, chop_frequency=300)),
    ],
)
def test_the_line_is_never_left_alone_for_longer_than_it_can_hold_bytes(
    programs: Programs, tmp_path: Path, electrodes: int, settings: ScanSettings
) -> None:
    watch, scan = tmp_path / "watch", Scan.of(Pattern.adjacent(electrodes))
    options = ("-f", "-w", str(watch), str(programs.elf))
    with (
        running(programs.emulator, tmp_path / "port", *options) as board,
        Link(SerialTransport(board.path), scan, settings) as link,
    ):
        frames_of(link, 30)
        deaf = Watch.read(watch).deaf
    assert 0 < deaf / CLOCK < TWO_BYTES
