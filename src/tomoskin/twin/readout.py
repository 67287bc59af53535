"""The board's electronics: potentials → amplifier → converter → counts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray, IntArray
from tomoskin.twin.sheet import TwinSkin

if TYPE_CHECKING:
    from tomoskin.skin import ReadoutSettings


@dataclass(frozen=True, eq=False)
class SampleTable:
    """What a scan samples: (n_samples,) channels that are source, sink and read each time."""

    source: IntArray
    sink: IntArray
    channel: IntArray
    oversampling: int


class Analogue(Protocol):
    """Whatever stands before the converter's output."""

    def sample(self, table: SampleTable) -> NDArray[np.uint16]:
        """(n_samples,) counts, each the sum of its conversions."""


def potentials(resistance: FloatArray, table: SampleTable, current: float) -> FloatArray:
    """(n_samples,) V of the channel read against the grounded sink, contacts included.

    ``resistance`` (n, n) Ω holds potentials per ampere for currents that sum to zero.
    """
    source, sink, channel = table.source, table.sink, table.channel
    driven = resistance[channel, source] - resistance[channel, sink]
    ground = resistance[sink, source] - resistance[sink, sink]
    return np.asarray(current * (driven - ground))


def convert(
    volts: FloatArray,
    settings: ReadoutSettings,
    oversampling: int,
    noise: float,
    random: np.random.Generator,
) -> NDArray[np.uint16]:
    """(n_samples,) summed codes of the potentials ``volts``.

    Amplified and shifted; each conversion then has its own Gaussian noise of ``noise`` LSB, is
    rounded down as the converter does (code = V · 2ⁿ / V_ref) and stops at the rails.
    """
    levels = 1 << settings.adc_bits
    exact = (settings.gain * volts + settings.offset) * (levels / settings.reference_voltage)
    noisy = random.standard_normal((oversampling, len(volts)))
    noisy *= noise
    noisy += exact
    np.floor(noisy, out=noisy)
    np.clip(noisy, 0, levels - 1, out=noisy)
    return np.asarray(noisy.sum(axis=0).astype(np.uint16))


class TwinElectronics:
    """Current source, amplifiers and converter on a twin's sheet."""

    def __init__(
        self,
        skin: TwinSkin,
        settings: ReadoutSettings,
        current: float,
        noise: float,
        seed: int,
    ) -> None:
        """``current`` A; ``noise`` LSB of one conversion."""
        self._skin = skin
        self._settings = settings
        self._current = current
        self._noise = noise
        self._random = np.random.default_rng(seed)
        self._volts: tuple[FloatArray, SampleTable, FloatArray] | None = None

    def sample(self, table: SampleTable) -> NDArray[np.uint16]:
        """Counts of one scan of the sheet as it is pressed now."""
        resistance = self._skin.resistance()
        known = self._volts
        if known is None or known[0] is not resistance or known[1] is not table:
            known = (resistance, table, potentials(resistance, table, self._current))
            self._volts = known
        return convert(known[2], self._settings, table.oversampling, self._noise, self._random)
