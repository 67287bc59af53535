"""Drives that the real firmware sends one by one, on both boards, and the frames they make."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from firmware.boards import running, star_counts
from firmware.emulator.pico import powered, star
from firmware.emulator.test_emulator import PATIENCE
from firmware.emulator.watch import CLOCK, Watch
from tomoskin.board.source import Link, ScanSettings, SerialTransport
from tomoskin.core import DriveSamples, Event, Frame
from tomoskin.model.pattern import Pattern, Scan
from tomoskin_emulator.program import PicoPrograms, Programs

SINGLY = ScanSettings(4, 200e-6, current_limit=0.1, adc_bits=10, singly=True)


def polled(link: Link, kind: type, count: int) -> list[DriveSamples | Frame | Event]:
    """Everything until ``count`` of a kind have come."""
    items: list[DriveSamples | Frame | Event] = []
    end = time.monotonic() + PATIENCE
    while sum(isinstance(item, kind) for item in items) < count:
        assert time.monotonic() < end
        items += link.poll(0.05)
    return items


def check_full_turns(link: Link, scan: Scan, expected: list[int]) -> None:
    """Frames are what whole scans would be, each behind its drives."""
    items = polled(link, Frame, 20)
    frames = [item for item in items if isinstance(item, Frame)]
    drives = [item for item in items if isinstance(item, DriveSamples)]
    assert [frame.sequence for frame in frames] == list(range(len(frames)))
    assert [frame.flags for frame in frames] == [1] + [0] * (len(frames) - 1)
    assert {frame.drops for frame in frames} == {0}
    for frame in frames:
        assert frame.samples.tolist() == expected
        assert frame.ticks == next(d.ticks for d in drives if d.sequence == frame.sequence)
    assert (np.diff([drive.ticks for drive in drives]) > 0).all()
    assert [d.drive for d in drives[: len(scan.drives)]] == list(range(len(scan.drives)))
    assert link.frames.lost == link.frames.stale == link.frames.foreign == 0
    assert link.counters.corrupt == 0


@pytest.mark.parametrize(("electrodes", "oversampling"), [(8, 4), (8, 1), (16, 4)])
def test_the_megas_drives(
    programs: Programs, tmp_path: Path, electrodes: int, oversampling: int
) -> None:
    """In real time, a line that nobody reads for a tenth of a second loses bytes; here it waits."""
    scan = Scan.of(Pattern.adjacent(electrodes))
    settings = replace(SINGLY, oversampling=oversampling)
    expected = star_counts(oversampling, scan)
    with (
        running(programs.emulator, tmp_path / "port", "-f", str(programs.elf)) as board,
        Link(SerialTransport(board.path), scan, settings) as link,
    ):
        check_full_turns(link, scan, expected)


def test_drives_shorter_than_their_messages_make_the_host_ask_for_whole_scans(
    programs: Programs, tmp_path: Path
) -> None:
    scan = Scan.of(Pattern.adjacent(8))
    settings = replace(SINGLY, oversampling=1, settling=0.0)
    with (
        running(programs.emulator, tmp_path / "port", str(programs.elf)) as board,
        Link(SerialTransport(board.path), scan, settings) as link,
    ):
        items = polled(link, Frame, 60)
        frames = [item for item in items if isinstance(item, Frame)]
        assert "whole-scans" in [item.kind for item in items if isinstance(item, Event)]
        assert {tuple(frame.samples.tolist()) for frame in frames} == {tuple(star_counts(1, scan))}
        assert not any(isinstance(item, DriveSamples) for item in polled(link, Frame, 20))


@pytest.mark.parametrize(("electrodes", "most_ms"), [(8, 0.8), (16, 1.2)])
def test_a_drive_of_the_mega_is_told_within_a_millisecond(
    programs: Programs, tmp_path: Path, electrodes: int, most_ms: float
) -> None:
    """By the emulator's clock: from the end of the drive to the last byte on the line."""
    scan = Scan.of(Pattern.adjacent(electrodes))
    settings = replace(SINGLY, settling=2e-3)
    watch = tmp_path / "watch"
    options = "-f", "-w", str(watch), str(programs.elf)
    took = []
    with (
        running(programs.emulator, tmp_path / "port", *options) as board,
        Link(SerialTransport(board.path), scan, settings) as link,
    ):
        for _ in range(40):
            polled(link, DriveSamples, 1)
            took.append(1e3 * Watch.read(watch).said / CLOCK)
        assert link.frames.lost == 0
    assert 0.2 < np.median(took) < most_ms


@pytest.mark.parametrize("electrodes", [8, 32])
def test_the_picos_drives(pico: PicoPrograms, tmp_path: Path, electrodes: int) -> None:
    scan = Scan.of(Pattern.adjacent(electrodes))
    settings = ScanSettings(4, 84e-6, 0.1, adc_bits=12, singly=True)
    with powered(pico, tmp_path, "-f") as board, board.link(scan, settings) as link:
        expected = star(scan, 4)
        check_full_turns(link, scan, expected)
