"""What a skin asks of the board against what the board gives: supply, amplifier and converter."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray
from tomoskin.model.forward import ForwardModel, State
from tomoskin.model.pattern import Scan
from tomoskin.model.skin import Skin
from tomoskin.sensing.signal.readout import FIGURES

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
