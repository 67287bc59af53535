"""What a link asks of a board, and how long it waits for it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Self

from tomoskin.core import SourceError

if TYPE_CHECKING:
    from tomoskin.model.skin import Skin

PRESCALERS = (16, 32, 64, 128)
"""Clock dividers of the ATmega2560's converter that leave it accurate enough."""

_CYCLES = 13
"""Converter clocks for one conversion (ATmega2560 datasheet, table 26-1)."""


_PACKED_BITS = 10

_CLOCK = 16e6
"""Clock of the board, Hz."""


def conversion_time(prescaler: int) -> float:
    """Seconds for one conversion."""
    return _CYCLES * prescaler / _CLOCK


def scan_time(n_drives: int, n_conversions: int, per_drive: float, prescaler: int) -> float:
    """Seconds for one scan: settling and dead time ``per_drive`` s, then the conversions."""
    return n_drives * per_drive + n_conversions * conversion_time(prescaler)


@dataclass(frozen=True)
class ScanSettings:
    """Timing and limits of a scan.

    Attributes
    ----------
    oversampling
        Conversions summed per sample.
    settling
        From connecting a drive to its first conversion, s.
    current_limit
        What the skin may carry, A; a board set higher refuses.
    adc_bits
        Converter resolution that the voltages are worked out with.
    dead_time
        All channels high-impedance between two drives, s. After a cut electrode the board's source
        needs 5 µs to come back from its end stop.
    prescaler
        Converter clock divider; 64 is 250 kHz at 16 MHz.
    chop_frequency
        Of an alternating drive, Hz; 0: the drive is direct.
    """

    oversampling: int
    settling: float
    current_limit: float
    adc_bits: int
    dead_time: float = 5e-6
    prescaler: int = 64
    chop_frequency: int = 0

    def __post_init__(self) -> None:
        """Check what every board would refuse."""
        if not 1 <= self.oversampling <= 64:
            raise SourceError(f"expected oversampling from 1 to 64, got {self.oversampling}")
        if self.oversampling * (2**self.adc_bits - 1) > 0xFFFF:
            raise SourceError(
                f"{self.oversampling} conversions of {self.adc_bits} bits do not fit a sample of "
                "16 bits",
                hint="lower the oversampling",
            )
        if not 0 <= self.settling <= 0.1:
            raise SourceError(f"expected a settling time from 0 to 0.1 s, got {self.settling} s")
        if self.prescaler not in PRESCALERS:
            raise SourceError(f"expected a prescaler of {PRESCALERS}, got {self.prescaler}")

    @property
    def packs(self) -> bool:
        """Whether samples fit ten bits, so that frames can be sent packed."""
        return self.oversampling == 1 and self.adc_bits == _PACKED_BITS

    def on_board(self, adc_bits: int) -> Self | None:
        """The settings that give samples of the same scale on a converter of ``adc_bits``.

        A finer one sums fewer conversions: 4 of 12 bits reach as far as 16 of 10 bits. None where
        it cannot be.
        """
        fewer = 1 << max(adc_bits - self.adc_bits, 0)
        if adc_bits < self.adc_bits or self.oversampling % fewer:
            return None
        return replace(self, oversampling=self.oversampling // fewer, adc_bits=adc_bits)

    @property
    def conversion(self) -> float:
        """Seconds that one conversion takes."""
        return conversion_time(self.prescaler)

    @classmethod
    def of(cls, skin: Skin) -> Self:
        """The settings that a skin file asks for."""
        return cls(
            oversampling=skin.readout.oversampling,
            settling=skin.readout.settling,
            current_limit=skin.current,
            adc_bits=skin.readout.adc_bits,
            chop_frequency=round(skin.chop_frequency),
        )


@dataclass(frozen=True)
class Timing:
    """Waiting times of a link, s.

    Attributes
    ----------
    hello
        How long to wait for HELLO before asking unbidden: opening a port resets a board, whose
        bootloader must not be spoken to.
    answer, tries
        How long to wait for an answer, and how often to ask.
    ping
        Between two heartbeats; a board stops after 2 s without.
    silence
        Without a frame for that long, or for four scans if that is longer, the board is silent.
    goodbye
        How long to wait for the answer to STOP on closing.
    """

    hello: float = 3.0
    answer: float = 0.3
    tries: int = 5
    ping: float = 0.5
    silence: float = 1.0
    goodbye: float = 0.3
