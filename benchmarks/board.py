"""Real firmware of both boards in emulators: values, sequence, alternating drive."""

from __future__ import annotations

import json
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from report import Floats, Report, rms, table
from tomoskin.board.source import BOARDS, Link, ScanSettings, SerialTransport, Timing
from tomoskin.core import Event, Frame
from tomoskin.model.pattern import Pattern, Scan
from tomoskin.sensing.signal import FIGURES
from tomoskin_emulator.board_process import BoardProcess, Front, OwnVoltages, SkinMemory
from tomoskin_emulator.program import programs_of

FRAMES, PICO_FRAMES, CHOPPED_FRAMES = 100_000, 2_000, 100
"""Of a case of the Mega, of the Pico, and with alternating drive."""

CASES = ((8, 1), (8, 4))
"""Electrodes and conversions summed: one conversion a sample is sent packed."""

PICO_CASES = tuple((n, settling) for n in (8, 16, 32) for settling in (84e-6, 36e-6))
"""Electrodes, and the slowest and the fastest settling that the decks give, s."""

SETTLING = {"mega": 200e-6, "pico": 84e-6}
FREQUENCIES = (
    ("mega", 8, (0, 150, 300, 700)),
    ("mega", 16, (0, 75, 300)),
    ("pico", 8, (0, 200, 1000, 2500, 3300)),
    ("pico", 16, (0, 200, 1000, 2000)),
)
"""Boards, electrodes and Hz of the alternation; 0: direct."""

SEED, TICKS = 3, 250e3
OVERSAMPLING = 16
"""Conversions of 10 bits a sample with alternating drive; of 12 bits a quarter."""

GAIN, REFERENCE, CURRENT, ARM = 35.0, 5.0, 0.1, 0.01
"""V; A; electrode e stands at the end of (1 + e) times so many Ω."""


def run() -> Iterator[Report]:
    yield table(
        f"{FRAMES:,} frames of the ELF under simavr",
        (_ran("mega", n, SETTLING["mega"], times, FRAMES) for n, times in CASES),
        f"settling {SETTLING['mega'] * 1e6:g} us, prescaler 64, 1 Mbaud, adjacent; a star of "
        "resistors, so that each sample is known to the last bit",
        "wrong: any sample or flag other than expected; resets: the host was too slow",
    )
    yield _on_pico(PICO_CASES, PICO_FRAMES)


def run_long() -> Iterator[Report]:
    """100,000 frames of the Pico's image in its emulator: two minutes or more."""
    yield _on_pico(PICO_CASES[:1], FRAMES)


def _on_pico(cases: Sequence[tuple[int, float]], frames: int) -> Report:
    return table(
        f"{frames:,} frames of the Pico's image under rp2040js",
        (_ran("pico", n, settling, 4, frames) for n, settling in cases),
        "adjacent, four conversions of 12 bits a sample, dead time 5 us; frames/s by the "
        "board's own clock",
        "jitter: of a conversion's instant in its drive, at most; processor: time awake",
    )


@contextmanager
def _emulated(
    board: str, front: Front, arms: Floats, link: Callable[[SerialTransport], Link],
    own: Floats | None = None,
) -> Iterator[tuple[Link, Path]]:  # fmt: skip
    """A linked board before a star of resistors, and the file in which its emulator counts."""
    with tempfile.TemporaryDirectory() as folder:
        watch = Path(folder) / "watch"
        voltages = {} if own is None else {"own": OwnVoltages(own)}
        memory = SkinMemory(Path(folder) / "skin", front, np.diag(arms), **voltages)
        counts = ("-w", str(watch)) if board == "pico" else ()
        process = BoardProcess(programs_of(board), memory.path, front.current, "-f", *counts)
        with link(SerialTransport(process.port)) as linked:
            yield linked, watch
        process.close()
        memory.close()
    assert not process.last_words, process.last_words


def _ran(
    board: str, electrodes: int, settling: float, oversampling: int, count: int
) -> dict[str, Any]:
    scan, kind = Scan.of(Pattern.adjacent(electrodes)), BOARDS[board]
    volts, bits = {"mega": 5.0, "pico": 3.3}[board], kind.adc_bits
    settings = ScanSettings(oversampling, settling, current_limit=0.1, adc_bits=bits)
    front = Front(0.1, 1e9, 1.0, 0.0, volts, float(1 << bits), 0.0)
    # emulated time runs faster than the host's on a Mega, so must the heartbeat; slower on a Pico
    timing = Timing(ping=0.02) if board == "mega" else Timing(answer=5.0, silence=60.0)
    wanted = _expected(scan, front, oversampling)
    arms = np.arange(1.0, electrodes + 1)
    with _emulated(board, front, arms, lambda to: Link(to, scan, settings, timing=timing)) as (
        link,
        watch,
    ):
        link.connect()
        before, began = _counted(watch), time.monotonic()
        seconds, wrong, resets = _watched(link, wanted, count)
        after, took = _counted(watch), time.monotonic() - began
        lost, corrupt = link.frames.lost, link.counters.corrupt
    row = {
        "electrodes": electrodes,
        "settling, us": f"{1e6 * settling:.0f}",
        "oversampling": oversampling,
        "frames/s": f"{count / seconds:.1f}",
        "wrong": wrong,
        "lost": lost,
        "corrupt": corrupt,
        "resets": resets,
        "times real": f"{seconds / took:.2f}",
    }
    if board == "pico":
        awake = (after["busy"] - before["busy"]) / (after["now"] - before["now"])
        row |= {"jitter, ns": f"{after['jitter']:.0f}", "processor": f"{100 * awake:.0f} %"}
    return row


def _counted(watch: Path) -> dict[str, float]:
    counted: dict[str, float] = json.loads(watch.read_text()) if watch.exists() else {}
    return counted


def _expected(scan: Scan, front: Front, oversampling: int) -> np.ndarray:
    """(n_samples,) counts of a star of 1 + e ohm."""
    source, sink = scan.drives[scan.sample_drive].T
    volts = front.current * (1 + sink + (scan.sample_electrode == source) * (1 + source))
    codes = np.floor(volts * front.levels / front.reference).clip(0, front.levels - 1)
    counts: np.ndarray = oversampling * codes.astype(np.uint16)
    return counts


def _watched(link: Link, wanted: np.ndarray, count: int) -> tuple[float, int, int]:
    """So many frames: s that they took by the board's clock, those that are wrong, its resets."""
    frames = wrong = resets = first = last = 0
    while frames < count:
        for item in link.poll(0.05):
            if not isinstance(item, Frame):
                resets += isinstance(item, Event) and item.kind == "reset"
                continue
            right = np.array_equal(item.samples, wanted)
            wrong += not (right and item.flags == (item.sequence == 0))
            first, last = (first if frames else item.ticks), item.ticks
            frames += 1
    return (last - first) * count / (frames - 1) / TICKS, wrong, resets


def run_chopped() -> Iterator[Report]:
    """Direct and alternating drive: frames a second and noise of both boards."""
    cases = ((b, n, f) for b, n, frequencies in FREQUENCIES for f in frequencies)
    yield table(
        f"{CHOPPED_FRAMES} frames of both boards' real firmware",
        (_chopped(*case, CHOPPED_FRAMES) for case in cases),
        "adjacent (skip:2 where a Pico drives alternately), "
        f"{OVERSAMPLING} conversions of 10 bits or {OVERSAMPLING // 4} of 12; "
        "settling 200 us (Mega) and 84 us (Pico), dead time 5 us; frames/s by the board's "
        "own clock",
        "noise: standard deviation of a row, of which the converter has 0.7 LSB of 10 "
        "bits; electrodes have a voltage of their own of 2 mV (standard deviation): offset "
        "seen is what the rows show of it, root mean square against none",
    )


def _chopped(board: str, electrodes: int, frequency: int, count: int) -> dict[str, Any]:
    own, case = np.random.default_rng(SEED).normal(0, 2e-3, electrodes), (board, frequency)
    quiet, _, _ = _rows(*case, np.zeros(electrodes), noise=0.0, count=3)
    still, _, _ = _rows(*case, own, noise=0.0, count=3)
    noisy, rate, periods = _rows(*case, own, noise=FIGURES.noise, count=count)
    return {
        "board": BOARDS[board].text,
        "electrodes": electrodes,
        "drive": f"{frequency} Hz" if frequency else "direct",
        "periods": periods or "",
        "frames/s": f"{rate:.1f}",
        "noise, uV": f"{1e6 * np.sqrt(np.mean(noisy.var(axis=0, ddof=1))):.0f}",
        "offset seen, uV": f"{1e6 * rms(still[-1] - quiet[-1]):.0f}",
    }


def _rows(
    board: str, frequency: int, own: Floats, noise: float, count: int
) -> tuple[Floats, float, int]:
    """(count, n_meas) V of an emulated board, its frames/s, and the periods of a drive."""
    turned = frequency and BOARDS[board].against == "neighbour"  # it cannot read neighbours then
    scan = Scan.of(Pattern.skip(len(own), 2 if turned else 0))
    bits = BOARDS[board].adc_bits
    finer = 1 << bits - 10
    settings = ScanSettings(
        OVERSAMPLING // finer, SETTLING[board], CURRENT, bits, chop_frequency=frequency
    )
    front = Front(CURRENT, 1e9, GAIN, 0.5, REFERENCE, float(1 << bits), noise * finer)
    arms, frames = ARM * np.arange(1.0, len(own) + 1), list[Frame]()
    with _emulated(
        board, front, arms, lambda to: Link(to, scan, settings, timing=Timing(ping=0.02)), own
    ) as (link, _):
        while len(frames) < count:
            frames += [item for item in link.poll(0.05) if isinstance(item, Frame)]
        mode = link.session.configuration.mode
    samples = np.array([frame.samples for frame in frames[:count]], dtype=float)
    last, first = frames[count - 1], frames[0]
    rate = (last.sequence - first.sequence) / ((last.ticks - first.ticks) / TICKS)
    per_count = REFERENCE / (1024 * GAIN * OVERSAMPLING)
    rows = (samples[:, scan.plus] - samples[:, scan.minus]) * per_count
    return rows, rate, mode.periods if mode else 0
