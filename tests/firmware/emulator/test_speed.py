"""How fast the ELF scans, by its own clock: the same on every machine."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest

from firmware.boards import running, star_counts
from firmware.emulator.test_emulator import frames_of
from tomoskin.board.source import Link, ScanSettings, SerialTransport
from tomoskin.model.pattern import Pattern, Scan
from tomoskin_emulator.program import Programs

# Electrodes, settling s, least frames/s; prescaler 64, no oversampling.
PROMISED = [(8, 2e-3, 40), (8, 200e-6, 180), (16, 2e-3, 17), (16, 200e-6, 55)]


@pytest.mark.parametrize(("electrodes", "settling", "least"), PROMISED)
def test_frames_per_second_and_every_value(
    programs: Programs, tmp_path: Path, electrodes: int, settling: float, least: float
) -> None:
    scan = Scan.of(Pattern.adjacent(electrodes))
    settings = ScanSettings(1, settling, current_limit=0.1, adc_bits=10, prescaler=64)
    with (
        running(programs.emulator, tmp_path / "port", "-f", str(programs.elf)) as board,
        Link(SerialTransport(board.path), scan, settings, clock=time.monotonic) as link,
    ):
        frames = frames_of(link, 30)
        assert link.frames.lost == link.counters.corrupt == 0
    for frame in frames:
        assert frame.samples.tolist() == star_counts(1, scan)
    ticks = np.diff([frame.ticks for frame in frames])
    assert 250e3 / ticks.max() >= least
