"""Direct and alternating drive: frames a second and noise of both boards, drift of the twin."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from report import Report
from tomoskin.board.source import Link, ScanSettings, SerialTransport, Timing
from tomoskin.core import FloatArray, Frame
from tomoskin.model.pattern import Pattern, Scan
from tomoskin.model.skin import Skin
from tomoskin.sensing.signal import FIGURES, Readout
from tomoskin.twin import TwinSettings, make_electronics, table_of
from tomoskin.twin.emulator import BoardProcess, Front, OwnVoltages, SkinMemory
from tomoskin.twin.emulator.source import BOARDS, programs_of

FRAMES = 100
SECONDS, SEED = 60.0, 3
OVERSAMPLING = 16
"""Conversions of 10 bits a sample; of 12 bits a quarter."""
GAIN, REFERENCE, CURRENT = 35.0, 5.0, 0.1
ARM = 0.01
"""Ω: electrode e stands at the end of (1 + e) times that."""


@dataclass(frozen=True)
class Case:
    """A board, its electrodes, s to settle, and Hz of the alternation; 0: direct."""

    board: str
    electrodes: int
    settling: float
    frequency: int


CASES = (
    *(Case("mega", 8, 200e-6, f) for f in (0, 150, 300, 700)),
    *(Case("mega", 16, 200e-6, f) for f in (0, 75, 300)),
    *(Case("pico", 8, 84e-6, f) for f in (0, 200, 1000, 2500, 3300)),
    *(Case("pico", 16, 84e-6, f) for f in (0, 200, 1000, 2000)),
)


def run(data: Path | None) -> tuple[Report, ...]:
    """Run every case; ``data`` is not needed."""
    del data
    return (
        Report(
            f"{FRAMES} frames of both boards' real firmware",
            ("board", "electrodes", "drive", "periods", "frames/s", "noise, uV", "offset seen, uV"),
            tuple(_ran(case) for case in CASES),
            (
                f"adjacent, {OVERSAMPLING} conversions of 10 bits or {OVERSAMPLING // 4} of 12; "
                "settling 200 us (Mega) and 84 us (Pico), dead time 5 us; frames/s by the board's "
                "own clock",
                "noise: standard deviation of a row, of which the converter has 0.7 LSB of 10 "
                "bits; electrodes have a voltage of their own of 2 mV (standard deviation): offset "
                "seen is what the rows show of it, root mean square against none",
            ),
        ),
        Report(
            f"{SECONDS:.0f} s of the twin: a gel with 8 electrodes that polarise, untouched",
            ("drive", "electrodes", "frames/s", "noise, uV", "drift, uV", "signal, uV"),
            tuple(_drifted(mode, kind) for mode in MODES for kind in ("ideal", "polarising")),
            (
                "200 mm disc, 200 ohm/sq, 1 mA, adjacent; preset hydrogel, whose temperature "
                f"drifts by itself; seed {SEED}",
                "noise: of a row, from frame to frame; drift: of the mean of a second from the "
                "first to the last, root mean square over the rows; signal: of the rows",
            ),
        ),
    )


def _ran(case: Case) -> tuple[object, ...]:
    scan = Scan.of(Pattern.adjacent(case.electrodes))
    own = np.random.default_rng(SEED).normal(0, 2e-3, case.electrodes)
    quiet, _, _ = _rows(case, scan, np.zeros(case.electrodes), noise=0.0, count=3)
    still, _, _ = _rows(case, scan, own, noise=0.0, count=3)
    noisy, rate, periods = _rows(case, scan, own, noise=FIGURES.noise, count=FRAMES)
    seen = float(np.sqrt(np.mean((still[-1] - quiet[-1]) ** 2)))
    noise = float(np.sqrt(np.mean(noisy.var(axis=0, ddof=1))))
    drive = f"{case.frequency} Hz" if case.frequency else "direct"
    name = BOARDS[case.board].text
    return (
        name, case.electrodes, drive, periods or "", f"{rate:.1f}", f"{1e6 * noise:.0f}",
        f"{1e6 * seen:.0f}",
    )  # fmt: skip


def _rows(
    case: Case, scan: Scan, own: FloatArray, noise: float, count: int
) -> tuple[FloatArray, float, int]:
    """(count, n_meas) V of an emulated board, its frames/s, and the periods of a drive."""
    bits = BOARDS[case.board].adc_bits
    finer = 1 << bits - 10
    settings = ScanSettings(
        OVERSAMPLING // finer, case.settling, CURRENT, bits, chop_frequency=case.frequency
    )
    levels = float(1 << bits)
    front = Front(CURRENT, 1e9, GAIN, 0.5, REFERENCE, levels, noise * finer)
    arms = np.diag(ARM * np.arange(1.0, case.electrodes + 1))
    with tempfile.TemporaryDirectory() as folder:
        memory = SkinMemory(Path(folder) / "skin", front, arms, own=OwnVoltages(own))
        board = BoardProcess(programs_of(case.board), memory.path, CURRENT, "-f")
        timing = Timing(ping=0.02)
        with Link(SerialTransport(board.port), scan, settings, timing=timing) as link:
            frames: list[Frame] = []
            while len(frames) < count:
                frames += [item for item in link.poll(0.05) if isinstance(item, Frame)]
            mode = link.configuration.mode
        board.close()
        memory.close()
    assert not board.last_words, board.last_words
    per_count = REFERENCE / (1024 * GAIN * OVERSAMPLING)
    samples = np.array([frame.samples for frame in frames[:count]], dtype=float)
    last, first = frames[count - 1], frames[0]
    rate = (last.sequence - first.sequence) / ((last.ticks - first.ticks) / 250e3)
    rows = (samples[:, scan.plus] - samples[:, scan.minus]) * per_count
    return rows, rate, mode.periods if mode else 0


MODES = ("direct", "chopped")


def _drifted(mode: str, electrodes: str) -> tuple[object, ...]:
    drive = {"current": "1 mA", "mode": mode}
    skin = Skin.load("textile-disc-8").altered(
        {
            "material": {"sheet_resistance": "200 ohm/sq"},
            "drive": drive | ({"chop_frequency": "0.3 kHz"} if mode == "chopped" else {}),
            "readout": {"gain": 4, "offset": "1 V", "settling": "500 us"},
            "twin": {"preset": "hydrogel", "electrodes": electrodes},
        }
    )
    scan = Scan.of(skin.pattern())
    table, readout = table_of(scan, ScanSettings.of(skin)), Readout.of(scan, skin.readout)
    board = make_electronics(skin, TwinSettings.preset("hydrogel", SEED))
    rows = []
    for time in np.arange(0.0, SECONDS, table.seconds):
        counts = board.sample(table, float(time))
        voltages = readout(Frame(0, 0, 0.0, 1, 0, 0, *table.readings(counts)))
        assert not voltages.excluded.any()
        rows.append(voltages.values)
    values = np.array(rows)
    second = round(1 / table.seconds)
    moved = values[-second:].mean(axis=0) - values[:second].mean(axis=0)
    noise = np.diff(values, axis=0).std() / np.sqrt(2)
    figures = (noise, np.sqrt(np.mean(moved**2)), np.sqrt(np.mean(values**2)))
    drive_text = "0.3 kHz" if mode == "chopped" else "direct"
    return drive_text, electrodes, f"{1 / table.seconds:.1f}", *(f"{1e6 * f:.0f}" for f in figures)
