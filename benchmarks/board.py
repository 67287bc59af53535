"""A long run of the real firmware in the emulator: values, sequence and switches are looked at."""

from __future__ import annotations

import json
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from report import Report
from tomoskin.board.source import Link, ScanSettings, SerialTransport, Timing
from tomoskin.core import Frame
from tomoskin.model.pattern import Pattern, Scan
from tomoskin.twin.emulator import (
    BoardProcess,
    Front,
    SkinMemory,
    programs_of,
)

FRAMES = 100_000
PICO_FRAMES = 2_000
"""Of each case; ``board_long`` has more."""
PICO_CASES = ((8, 84e-6), (8, 36e-6), (16, 84e-6), (16, 36e-6), (32, 84e-6), (32, 36e-6))
"""Electrodes, and the slowest and the fastest settling that the decks give, s."""
# electrodes, conversions summed: one conversion a sample is sent packed
CASES = ((8, 1), (8, 4))
SETTLING = 200e-6
_STAR = Front(0.1, 1e9, 1.0, 0.0, 5.0, 1024.0, 0.0)
_PICO_STAR = Front(0.1, 1e9, 1.0, 0.0, 3.3, 4096.0, 0.0)


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
        pico_report(PICO_FRAMES, PICO_CASES),
    )


def pico_report(frames: int, cases: Sequence[tuple[int, float]]) -> Report:
    """So many frames of each case of electrodes and settling."""
    return Report(
        f"{frames:,} frames of the Pico's image under rp2040js",
        (
            "electrodes",
            "settling, us",
            "frames/s",
            "wrong",
            "lost",
            "jitter, ns",
            "processor",
            "times real",
        ),
        tuple(_ran_pico(*case, frames) for case in cases),
        (
            "adjacent, four conversions of 12 bits a sample, dead time 5 us; frames/s by the "
            "board's own clock",
            "jitter: by which the instant of one and the same conversion moves against the "
            "beginning of its drive, at most; processor: share of the time that it is awake",
        ),
    )


def _ran_pico(electrodes: int, settling: float, frames: int) -> tuple[object, ...]:
    scan = Scan.of(Pattern.adjacent(electrodes))
    settings = ScanSettings(4, settling, current_limit=0.1, adc_bits=12)
    wanted = _expected(scan, _PICO_STAR, 4)
    with tempfile.TemporaryDirectory() as folder:
        seen_at = Path(folder) / "watch"
        arms = np.diag(np.arange(1.0, electrodes + 1))
        memory = SkinMemory(Path(folder) / "skin", _PICO_STAR, arms)
        programs = programs_of("pico")
        board = BoardProcess(programs, memory.path, _PICO_STAR.current, "-f", "-w", str(seen_at))
        patient = Timing(answer=5.0, silence=60.0)  # its time goes slower than the host's
        with Link(SerialTransport(board.port), scan, settings, timing=patient) as link:
            link.connect()
            before, began = json.loads(seen_at.read_text()), time.monotonic()
            _, wrong, _, ticks = _watched(link, wanted, frames)
            after, took = json.loads(seen_at.read_text()), time.monotonic() - began
            lost = link.frames.lost
        board.close()
        memory.close()
    assert not board.last_words, board.last_words
    awake = (after["busy"] - before["busy"]) / (after["now"] - before["now"])
    rate = (frames - 1) / (ticks / 250e3)
    name = f"{settling * 1e6:.0f}"
    shares = f"{after['jitter']:.0f}", f"{100 * awake:.0f} %", f"{ticks / 250e3 / took:.2f}"
    return electrodes, name, f"{rate:.0f}", wrong, lost, *shares


def _expected(scan: Scan, front: Front, oversampling: int) -> np.ndarray:
    """(n_samples,) counts of a star of 1 + e ohm."""
    source, sink = scan.drives[scan.sample_drive].T
    volts = front.current * (1 + sink + (scan.sample_electrode == source) * (1 + source))
    codes = np.floor(volts * front.levels / front.reference).clip(0, front.levels - 1)
    counts: np.ndarray = oversampling * codes.astype(np.uint16)
    return counts


def _ran(electrodes: int, oversampling: int) -> tuple[object, ...]:
    scan = Scan.of(Pattern.adjacent(electrodes))
    settings = ScanSettings(oversampling, SETTLING, current_limit=0.1, adc_bits=10)
    arms = np.arange(1.0, electrodes + 1)
    wanted = _expected(scan, _STAR, oversampling)
    with tempfile.TemporaryDirectory() as folder:
        memory = SkinMemory(Path(folder) / "skin", _STAR, np.diag(arms))
        board = BoardProcess(programs_of("mega"), memory.path, _STAR.current, "-f")
        began = time.monotonic()
        # emulated time runs faster than the host's: so must the heartbeat
        with Link(SerialTransport(board.port), scan, settings, timing=Timing(ping=0.02)) as link:
            seen, wrong, resets, ticks = _watched(link, wanted, FRAMES)
            lost, corrupt = link.frames.lost, link.counters.corrupt
        took = time.monotonic() - began
        board.close()
        memory.close()
    assert not board.last_words, board.last_words
    speed = f"{ticks / 250e3 / took:.1f}"
    return electrodes, oversampling, f"{seen:,}", wrong, lost, corrupt, resets, speed


def _watched(link: Link, wanted: np.ndarray, count: int) -> tuple[int, int, int, int]:
    """Frames seen, those that are wrong, fresh starts of the board, ticks from first to last."""
    seen = wrong = resets = first = last = 0
    while seen < count:
        for item in link.poll(0.05):
            if isinstance(item, Frame):
                right = np.array_equal(item.samples, wanted)
                wrong += not (right and item.flags == (item.sequence == 0))
                first, last = (first if seen else item.ticks), item.ticks
                seen += 1
            else:
                resets += item.kind == "reset"
    return seen, wrong, resets, last - first
