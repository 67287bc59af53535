"""A long run of the real firmware in the emulator: values, sequence and switches are looked at."""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

import numpy as np

from report import Report
from tomoskin.core import Frame
from tomoskin.emulator import BoardProcess, Front, SkinMemory, build_programs
from tomoskin.pattern import Pattern, Scan
from tomoskin.source import Link, ScanSettings, SerialTransport, Timing

FRAMES = 100_000
# electrodes, conversions summed: one conversion a sample is sent packed
CASES = ((8, 1), (8, 4))
SETTLING = 200e-6
_STAR = Front(0.1, 1e9, 1.0, 0.0, 5.0, 1024.0, 0.0)


def run(data: Path | None) -> tuple[Report, ...]:
    """Run every case; ``data`` is not needed."""
    del data
    return (
        Report(
            f"{FRAMES:,} frames of the ELF under simavr",
            (
                "electrodes",
                "oversampling",
                "frames",
                "wrong",
                "lost",
                "corrupt",
                "resets",
                "times real",
            ),
            tuple(_ran(*case) for case in CASES),
            (
                f"settling {SETTLING * 1e6:g} us, prescaler 64, 1 Mbaud, adjacent; a star of "
                "resistors, so that each sample is known to the last bit",
                "wrong: frames with any sample or flag other than expected; resets: the host was "
                "too slow for the heartbeat of a board several times faster than real time",
            ),
        ),
    )


def _ran(electrodes: int, oversampling: int) -> tuple[object, ...]:
    scan = Scan.of(Pattern.adjacent(electrodes))
    settings = ScanSettings(oversampling, SETTLING, current_limit=0.1, adc_bits=10)
    arms = np.arange(1.0, electrodes + 1)
    source, sink = scan.drives[scan.sample_drive].T
    volts = _STAR.current * (arms[sink] + (scan.sample_electrode == source) * arms[source])
    wanted = oversampling * np.floor(volts * _STAR.levels / _STAR.reference).astype(np.uint16)
    with tempfile.TemporaryDirectory() as folder:
        memory = SkinMemory(Path(folder) / "skin", _STAR, np.diag(arms))
        board = BoardProcess(build_programs(), memory.path, _STAR.current, "-f")
        began = time.monotonic()
        # emulated time runs faster than the host's: so must the heartbeat
        with Link(SerialTransport(board.port), scan, settings, timing=Timing(ping=0.02)) as link:
            seen, wrong, resets, ticks = _watched(link, wanted)
            lost, corrupt = link.frames.lost, link.counters.corrupt
        took = time.monotonic() - began
        board.close()
        memory.close()
    assert not board.last_words, board.last_words
    speed = f"{ticks / 250e3 / took:.1f}"
    return electrodes, oversampling, f"{seen:,}", wrong, lost, corrupt, resets, speed


def _watched(link: Link, wanted: np.ndarray) -> tuple[int, int, int, int]:
    """Frames seen, those that are wrong, fresh starts of the board, ticks from first to last."""
    seen = wrong = resets = first = last = 0
    while seen < FRAMES:
        for item in link.poll(0.05):
            if isinstance(item, Frame):
                right = np.array_equal(item.samples, wanted)
                wrong += not (right and item.flags == (item.sequence == 0))
                first, last = (first if seen else item.ticks), item.ticks
                seen += 1
            else:
                resets += item.kind == "reset"
    return seen, wrong, resets, last - first
