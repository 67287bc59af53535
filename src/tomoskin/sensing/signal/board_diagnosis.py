"""What is wrong with a board: what a multimeter shows at first, then its readings on a ring."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Self

import numpy as np

from tomoskin.core import DataError, FloatArray, IntArray
from tomoskin.sensing.signal.load_ring import BoardFault, LoadRing, potentials, single_faults
from tomoskin.sensing.signal.readout import FIGURES

_SUPPLY, _FIVE, _REFERENCE, _DUMP = 12.0, 5.0, 1.225, 22.0
"""V; V; V across the sense resistor; Ω from the bus to ground while no source is enabled."""

_OFF = 1.0
"""V at +12V that a switch's leakage may leave."""

_SAG = 0.385e-3 * 120.0
"""V a channel that −5V sags: an INA118 draws at most 0.385 mA through at most 120 Ω of U1."""

STAGES = {
    "supply": "12 V in, limited to 200 mA, no Arduino, jumpers on 2-3, nothing at the terminals",
    "Arduino": "the same, the Arduino plugged, not flashed or in reset",
    "ring": "the ring of resistors at the terminals, the firmware idle",
}
"""What is connected, in order."""


@dataclass(frozen=True, slots=True)
class MeterStep:
    """One reading of a multimeter.

    Attributes
    ----------
    stage
        One of :data:`STAGES`.
    point
        Where its red lead is; the black one is on GND unless the point says otherwise.
    low, high
        What is expected, V.
    otherwise
        Where to look when it is not.
    """

    stage: str
    point: str
    low: float
    high: float
    otherwise: str

    @property
    def expected(self) -> str:
        """The range as people read it: ``11.80 to 12.20 V``."""
        digits = 3 if self.high < 0.05 else 2
        return f"{self.low:.{digits}f} to {self.high:.{digits}f} V"

    def accepts(self, volts: float) -> bool:
        """Whether ``volts`` is what is expected."""
        return self.low <= volts <= self.high


def meter_steps(
    current: float, channels: int, read: Mapping[str, float] | None = None
) -> Iterator[MeterStep]:
    """The readings in their order, of a board that is set to ``current`` A.

    What is right at one point depends on what was ``read`` at others, V by point. So the caller
    may add each reading there before the next step is made.
    """
    read = {} if read is None else read
    yield MeterStep("supply", "12V IN", 11.4, 12.6, "0 V: polarity, fuse F1")
    yield MeterStep("supply", "+12V", -0.1, _OFF, "Q1, Q2: 12 V must not come without 5 V")
    yield MeterStep(
        "supply",
        "1 kΩ between E1 and E2, across it",
        -0.001,
        0.001,
        "a gate is not off at rest: Q101 to Q103, Q201 to Q203; the same for other pairs",
    )
    yield MeterStep("Arduino", "+5V", 4.75, 5.25, "USB, header J61")
    five, supply = read.get("+5V", _FIVE), read.get("12V IN", _SUPPLY)
    yield MeterStep("Arduino", "+12V", supply - 0.2, supply + 0.05, "Q1, Q2, R3 to R5")
    rail = read.get("+12V", 0.0)
    supply = rail if rail > _OFF else supply  # else it is the reading of the stage before
    sag = 0.1 + _SAG * channels
    yield MeterStep("Arduino", "-5V", -five - 0.05, -five + sag, "U1, C2, C3")
    yield MeterStep("Arduino", "2.5V", 2.49, 2.51, "U2, U3")
    bus, sense = _DUMP * current, supply - _REFERENCE
    yield MeterStep("Arduino", "BUS", 0.95 * bus, 1.05 * bus, "U23, Q22, R27")
    yield MeterStep("Arduino", "SENSE", sense - 0.2, sense + 0.2, "R23, R24, Q21")
    yield MeterStep("Arduino", "MINUS", -0.005, 0.005, "jumper J41 on 2-3")
    yield MeterStep("Arduino", "MIDDLE", -0.005, 0.005, "jumper J42 on 2-3")
    shorted = "Q101 to Q103, Q201 to Q203"
    yield MeterStep("ring", "E1, black lead on E2", -0.001, 0.001, shorted)


_TOLERANCE = 0.015
"""RMS deviation over the largest reading that resistors of 1 % and sound channels stay below."""

_FEW = 1.5
"""The same for small readings, counts."""

_LARGEST = 4.0
"""Times that RMS: no single reading may be further off."""

_AS_GOOD = 1.3
"""Faults whose deviation is within this of the best one's cannot be told apart."""

_CURRENT = 0.03
"""Relative error of the current that board and resistors may have."""

_UNMEASURED = 0.05
"""Relative error of a converter's reference that is USB's 5 V, where nobody has measured them."""

_SCALE = (0.85, 1.15)
"""Of the current, while a fault is looked for."""

_AFFINE_GAIN = 0.05


@dataclass(frozen=True, slots=True)
class CountScale:
    """code = volts · ``per_volt``, from 0 to ``top``; whether the reference was measured."""

    per_volt: float
    top: float
    measured: bool = True

    @classmethod
    def of(cls, gain: float, reference: float, bits: int, *, measured: bool = True) -> Self:
        """Of an amplifier and a converter of ``bits`` with ``reference`` V."""
        return cls(gain * (1 << bits) / reference, (1 << bits) - 1.0, measured)


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """What the readings say.

    Attributes
    ----------
    scale
        Current times resistance over its nominal value.
    sink_ohms
        Mean resistance from a sink's electrode to ground, Ω: transistor, tracks, joints.
    deviation, largest
        RMS and largest of what the best explanation leaves, counts.
    faults
        Sentences, of which one holds; empty: the board is sound.
    """

    scale: float
    sink_ohms: float
    deviation: float
    largest: float
    faults: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class _Fit:
    text: str
    scale: float
    sink_drop: float
    deviation: float
    largest: float


def diagnose(
    counts: FloatArray, ring: LoadRing, drives: IntArray, current: float, scale: CountScale
) -> Diagnosis:
    """Compare readings with a sound board and with each single fault.

    Parameters
    ----------
    counts
        (n_drives, n) mean of a conversion of each channel under each drive.
    drives
        (n_drives, 2) source, sink.
    current
        A, nominal.

    Raises DataError for another shape.
    """
    counts = np.asarray(counts, dtype=float)
    if counts.shape != (len(drives), len(ring.ohms)):
        raise DataError(
            f"expected readings of {len(drives)} drives by {len(ring.ohms)} channels, "
            f"got {counts.shape}"
        )
    volts = potentials(ring, drives, current)
    nominal = BoardFault("", volts, np.zeros(volts.shape, bool))
    sound = _fit(counts, nominal, scale, (0.02, 1.4))
    limit = max(_TOLERANCE * float(volts.max()) * scale.per_volt, _FEW)
    sink_ohms = FIGURES.switch_resistance + sound.sink_drop / scale.per_volt / current
    figures = (sound.scale, sink_ohms, sound.deviation, sound.largest)
    if sound.deviation <= limit * min(sound.scale, 1) and sound.largest <= _LARGEST * limit:
        off = abs(sound.scale - 1) > _CURRENT + (0 if scale.measured else _UNMEASURED)
        said = (_wrong_current(sound.scale, current),) if off else ()
        return Diagnosis(*figures, said)
    fits = [_fit(counts, one, scale, _SCALE) for one in single_faults(ring, drives, current)]
    fits += _amplifiers(counts, nominal, scale)
    best = min(fits, key=lambda fit: fit.deviation)
    if best.deviation > 2 * limit:
        return Diagnosis(*figures, tuple(_unexplained(counts, nominal, sound, scale, drives)))
    close = [fit for fit in fits if fit.deviation <= _AS_GOOD * best.deviation + _FEW / 4]
    close.sort(key=lambda fit: fit.deviation)
    return Diagnosis(*figures[:2], best.deviation, best.largest, tuple(f.text for f in close[:4]))


def _fit(
    counts: FloatArray,
    fault: BoardFault,
    scale: CountScale,
    bounds: tuple[float, float],
    left_out: int | None = None,
) -> _Fit:
    """Least squares of the current's scale and the sinks' drop, on readings within the rails."""
    ideal = fault.volts * scale.per_volt
    judged = ~fault.unknown
    if left_out is not None:
        judged[:, left_out] = False
    inside = judged & (ideal < scale.top) & (counts < scale.top) & (counts > 0)
    times, drop = _line(ideal[inside], counts[inside])
    times = float(np.clip(times, *bounds))
    model = np.clip(times * ideal + np.where(ideal > 0, drop, 0.0), 0, scale.top)
    residual = (counts - model)[judged]
    rms, largest = float(np.sqrt(np.mean(residual**2))), float(np.abs(residual).max())
    return _Fit(fault.text, times, drop, rms, largest)


def _line(x: FloatArray, y: FloatArray) -> tuple[float, float]:
    """Slope and intercept of y over x; 1 and 0 where there is nothing to fit."""
    if len(x) < 3 or np.ptp(x) < 1:
        return 1.0, 0.0
    here, there = x - x.mean(), y - y.mean()
    slope = float(here @ there / (here @ here))
    return slope, float(y.mean() - slope * x.mean())


def _amplifiers(counts: FloatArray, nominal: BoardFault, scale: CountScale) -> Iterator[_Fit]:
    """Channels of which one reads wrongly, all others rightly."""
    for e in range(counts.shape[1]):
        rest = _fit(counts, nominal, scale, _SCALE, left_out=e)
        ideal = rest.scale * nominal.volts[:, e] * scale.per_volt + rest.sink_drop
        gain, offset = _line(ideal, counts[:, e])
        model = np.clip(gain * ideal + offset, 0, scale.top)
        if np.ptp(counts[:, e]) < 1:
            gain, model = 0.0, np.full(len(ideal), counts[:, e].mean())
        residual = counts[:, e] - model
        n = counts.shape[1]
        rms = float(np.sqrt((rest.deviation**2 * (n - 1) + np.mean(residual**2)) / n))
        largest = max(rest.largest, float(np.abs(residual).max()))
        text = _of_an_amplifier(e, gain, offset, float(counts[:, e].mean()) / scale.top)
        yield _Fit(text, rest.scale, rest.sink_drop, rms, largest)


def _of_an_amplifier(e: int, gain: float, offset: float, level: float) -> str:
    name, part = f"E{e + 1}", 100 * (e + 1)
    if abs(gain) < _AFFINE_GAIN:
        return (
            f"the reading of {name} stays at {level:.0%} of its range: U{part + 1}, U{part + 2}, "
            "its header's pin"
        )
    if abs(gain - 1) < _AFFINE_GAIN:
        return f"the reading of {name} is {offset:+.0f} counts off: U{part + 1}, D{part + 2}"
    return f"the reading of {name} is {gain:.2g} times what it should be: R{part + 8}, U{part + 1}"


def _wrong_current(times: float, current: float) -> str:
    return (
        f"the current, or all resistors, are {times:.3g} times what they should be "
        f"({times * current * 1e3:.4g} mA): R23, R24, U21"
    )


def _unexplained(
    counts: FloatArray, nominal: BoardFault, sound: _Fit, scale: CountScale, drives: IntArray
) -> Iterator[str]:
    """The largest deviations, where no single fault explains them."""
    model = sound.scale * nominal.volts * scale.per_volt + sound.sink_drop
    model = np.clip(model, 0, scale.top)
    off = np.abs(counts - model)
    yield "no single fault explains the readings; the largest deviations follow"
    for flat in np.argsort(off, axis=None)[::-1][:4]:
        drive, e = np.unravel_index(flat, off.shape)
        source, sink = drives[drive]
        yield (
            f"E{e + 1}, driven E{source + 1} to E{sink + 1}: {counts[drive, e]:.0f} counts, "
            f"expected {model[drive, e]:.0f}"
        )
