"""Raw counts of a frame → volts in the pattern's order; and what a skin asks of the board against
what that gives: supply, amplifier and converter."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray

from tomoskin.board.source import BOARDS, DEFAULT_BOARD
from tomoskin.core import DataError, FloatArray, Frame, Voltages
from tomoskin.model.forward import ForwardModel, State
from tomoskin.model.pattern import Scan
from tomoskin.model.skin import ReadoutSettings, Skin

_LARGE = 0.05
"""Part of the converter's range above which an electrode's own voltage is worth a word: so much of
the range is lost to it."""


@dataclass(frozen=True, eq=False)
class OwnVoltage:
    """Own voltages of a scan's electrodes.

    Attributes
    ----------
    matrix
        (n_electrodes, n_samples) V per count of the sums; the mean over the electrodes is 0.
    large
        V above which one is worth a word.
    """

    matrix: FloatArray
    large: float

    @classmethod
    def of(cls, scan: Scan, volts_per_count: float, full: float) -> Self:
        """Of a read-out whose range has ``full`` counts."""
        n_drives, n = len(scan.drives), int(scan.sample_electrode.max(initial=-1)) + 1
        by_drive = scan.sample_drive[:, None] == np.arange(n_drives)
        by_electrode = scan.sample_electrode[:, None] == np.arange(n)
        design = np.hstack([by_drive, by_electrode]).astype(np.float64)
        matrix = np.linalg.pinv(design)[n_drives:] * volts_per_count
        return cls(matrix - matrix.mean(axis=0), _LARGE * full * volts_per_count)

    def __call__(self, sums: NDArray[np.uint16]) -> FloatArray:
        """(n_electrodes,) V against their mean, of the (n_samples,) sums of a frame."""
        return np.asarray(self.matrix @ sums.astype(np.float64))


FIGURES = BOARDS[DEFAULT_BOARD].electronics
"""The electronics of the board where none is named."""

CONVERSION_NOISE = FIGURES.noise
"""Standard deviation of one conversion before it is rounded, in LSB, of the simulated board;
rounding adds 1/√12 LSB, and a row is the difference of two samples."""


@dataclass(frozen=True, eq=False)
class Readout:
    """The converter and amplifier chain, inverted.

    Attributes
    ----------
    scan
        Which sample is which electrode under which drive.
    volts_per_count
        Skin voltage per count of the summed readings, V.
    low, high
        A sample at or beyond these summed counts stood at a rail; of an alternating drive, half of
        them in either direction.
    noise
        Standard deviation of a row that the converter alone causes, V.
    rounding
        The part of it that rounding alone causes, V: 1/√12 of a step a reading.
    tick_rate
        Of the frames' ticks, Hz, where the board states no other.
    """

    scan: Scan
    volts_per_count: float
    low: int
    high: int
    noise: float
    rounding: float
    tick_rate: float

    @classmethod
    def of(cls, scan: Scan, settings: ReadoutSettings) -> Self:
        """Read-out of a skin; one count of each summed reading is kept as margin at the rails."""
        levels = 1 << settings.adc_bits
        n = settings.oversampling
        volts = settings.reference_voltage / (levels * settings.gain * n)
        noise, rounding = (
            volts * float(np.sqrt(2 * n * (sd**2 + 1 / 12))) for sd in (CONVERSION_NOISE, 0.0)
        )
        return cls(scan, volts, n, (levels - 2) * n, noise, rounding, settings.tick_rate)

    def __call__(
        self,
        frame: Frame,
        tick_rate: float | None = None,
        scan: tuple[float, float] = (math.nan, math.nan),
    ) -> Voltages:
        """Voltages of one frame, whose clock runs at ``tick_rate`` Hz.

        ``scan``: host time of its middle, and its duration, s.

        The amplifier's offset is common to both samples of a row and leaves with the difference.

        Raises
        ------
        DataError
            When the frame has another number of samples than the scan.
        """
        if len(frame.samples) != self.scan.n_samples:
            raise DataError(
                f"expected {self.scan.n_samples} samples, got {len(frame.samples)}",
                where=f"frame {frame.sequence}",
            )
        values, railed = self.rows(frame.samples, frame.sums)
        return Voltages(
            values=values,
            excluded=railed,
            time=frame.ticks / (tick_rate or self.tick_rate),
            host_time=frame.host_time,
            sequence=frame.sequence,
            samples=frame.samples,
            own=None if frame.sums is None else self.own_voltage(frame.sums),
            scanned=scan[0],
            scan_time=scan[1],
        )

    @cached_property
    def own_voltage(self) -> OwnVoltage:
        """What electrodes show that does not turn with the current."""
        return OwnVoltage.of(self.scan, self.volts_per_count, self.high)

    def rows(
        self, samples: NDArray[np.uint16], sums: NDArray[np.uint16] | None = None
    ) -> tuple[FloatArray, NDArray[np.bool_]]:
        """(..., n_meas) V, and whether a sample of it stood at a rail, of (..., n_samples) counts.

        With ``sums``, of an alternating drive.
        """
        counts = samples.astype(np.float64)
        plus, minus = self.scan.plus, self.scan.minus
        ends = counts if sums is None else np.multiply(2, directions(samples, sums))
        at_rail = (ends <= self.low) | (ends >= self.high)
        at_rail = at_rail if sums is None else at_rail.any(axis=0)
        volts = (counts.take(plus, -1) - counts.take(minus, -1)) * self.volts_per_count
        return np.asarray(volts), np.asarray(at_rail.take(plus, -1) | at_rail.take(minus, -1))


def directions(
    samples: NDArray[np.uint16], sums: NDArray[np.uint16]
) -> tuple[FloatArray, FloatArray]:
    """Counts with the current from source to sink, and from sink to source; shapes as given."""
    difference = samples.astype(np.float64) - _NO_DIFFERENCE
    return (sums + difference) / 2, (sums - difference) / 2


_NO_DIFFERENCE = 0x8000
"""What stands for no difference between the directions of an alternating drive."""


_ROOM = 0.8
"""Part of a range that the untouched skin may fill: a press needs the rest."""

_LEAST_CURRENT = 1e-6
"""A, below which no skin file goes."""


@dataclass(frozen=True, eq=False)
class Headroom:
    """The voltages that the model expects of the untouched skin, beside the board's limits.

    Attributes
    ----------
    current, gain
        As the skin has them: A, and in front of the converter.
    drive
        (n_drives,) V across each driven pair and its two switches.
    samples
        (n_samples,) V at the amplifier's input, against the sink line.
    readable
        V at that input between which amplifier and converter read.
    saturated
        (n_meas,) bool: measurements of a drive that the supply cannot hold, or of a sample beyond
        ``readable``.
    """

    current: float
    gain: float
    drive: FloatArray
    samples: FloatArray
    readable: tuple[float, float]
    saturated: NDArray[np.bool_]

    @classmethod
    def of(cls, skin: Skin, state: State) -> Self:
        """Of a skin whose model at rest is ``state``."""
        settings, current = skin.readout, skin.current
        scan, resistance = Scan.of(state.model.pattern), state.transfer_resistance
        source, sink = scan.drives.T
        field = current * (resistance[source] - resistance[sink]).real
        rows = np.arange(len(field))
        above = field - field[rows, sink][:, None]
        drive = above[rows, source] + 2 * current * FIGURES.switch_resistance
        samples = above[scan.sample_drive, scan.sample_electrode]
        top = min(settings.reference_voltage, FIGURES.high_rail)
        low, high = ((volts - settings.offset) / settings.gain for volts in (FIGURES.low_rail, top))
        beyond = (samples > high) | (samples < low)
        beyond |= (drive > FIGURES.compliance)[scan.sample_drive]
        saturated = beyond[scan.plus] | beyond[scan.minus]
        return cls(current, settings.gain, drive, samples, (low, high), saturated)

    @classmethod
    def of_skin(cls, skin: Skin) -> Self:
        """Of a skin alone. Raises TomoskinError when it cannot be meshed or modelled."""
        model = ForwardModel(skin.mesh(), skin.pattern(), skin.contact_impedance, skin.current)
        return cls.of(skin, model.at(skin.conductivity))

    @property
    def text(self) -> str:
        """How much of supply and converter is used."""
        low, high = self.readable
        return (
            f"{_volts(self.drive.max())} across a driven pair (supply: "
            f"{_volts(FIGURES.compliance)}), {_volts(self.samples.min())} to "
            f"{_volts(self.samples.max())} at the inputs (read at a gain of {self.gain:g}: "
            f"{_volts(low)} to {_volts(high)})"
        )

    def figures(self) -> dict[str, float]:
        """The same figures for programs, V."""
        return {
            "drive_v": float(self.drive.max()),
            "supply_v": FIGURES.compliance,
            "least_input_v": float(self.samples.min()),
            "most_input_v": float(self.samples.max()),
            "least_readable_v": self.readable[0],
            "most_readable_v": self.readable[1],
        }

    @property
    def problem(self) -> str | None:
        """What is beyond the board, and what would fit, in a sentence; None where nothing is."""
        if not self.saturated.any():
            return None
        count = np.count_nonzero(self.saturated)
        return (
            f"{count} of {len(self.saturated)} measurements saturate according to the skin's "
            f"model, {self.text}: {self._remedy}"
        )

    @property
    def _remedy(self) -> str:
        """Current or gain that leaves room, rounded down."""
        low, high = self.readable
        least, most = self.samples.min(), self.samples.max()
        if least < low or high <= 0:
            return "use an offset that puts 0 V at the inputs within the converter's range"
        supply = min(1.0, _ROOM * FIGURES.compliance / float(self.drive.max()))
        both = min(supply, _ROOM * high / float(most))
        choices = []
        if self.current * both >= _LEAST_CURRENT:
            choices.append(f"a current of {_down(1e3 * self.current * both)} mA fits")
        gain = f"a gain of {_down(self.gain * both / supply)}"
        if supply == 1.0:
            choices.append(f"{gain} fits")
        elif both < supply and self.current * supply >= _LEAST_CURRENT:
            choices.append(f"{_down(1e3 * self.current * supply)} mA with {gain}")
        return ", or ".join(choices) or "use a sheet or contacts of lower resistance"


def _volts(value: float) -> str:
    if abs(value) >= 100:
        return f"{value:.0f} V"
    return f"{value:.3g} V" if abs(value) >= 1 or value == 0 else f"{1e3 * value:.3g} mV"


def _down(value: float) -> str:
    """Two digits, rounded towards zero."""
    step = 10.0 ** (math.floor(math.log10(value)) - 1)
    return f"{math.floor(value / step * (1 + 1e-9)) * step:.2g}"
