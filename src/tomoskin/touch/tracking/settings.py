"""How touches are told from noise, from each other and from their residual responses."""

from __future__ import annotations

from dataclasses import dataclass

HELD = 0.6
"""Part of the signal-to-noise ratio of an onset above which a touch goes on: between the two it
neither begins nor ends."""


@dataclass(frozen=True, slots=True)
class TrackSettings:
    """Times are seconds of the device, so that 10 and 1,000 frames/s are treated the same.

    Attributes
    ----------
    snr
        Signal-to-noise ratio at which a touch begins; at :data:`HELD` of it, it ends.
    onset, release
        Seconds for which a touch must be seen before it is reported, and missing before it is
        released; two frames at least, unless they are 0.
    speed, turning
        Standard deviation of a finger's speed along each axis, m/s, and the time after which it
        moves otherwise, s.
    wander
        What the position of a detection wanders beside its noise, m.
    """

    snr: float = 5.0
    onset: float = 0.02
    release: float = 0.05
    speed: float = 0.3
    turning: float = 0.3
    wander: float = 0.006

    @property
    def least_snr(self) -> float:
        """Below which there is no detection."""
        return HELD * self.snr

    @property
    def still(self) -> bool:
        """Whether a frame tells nothing of the next one."""
        return self.onset == 0 and self.release == 0


STILL = TrackSettings(onset=0.0, release=0.0)
"""For frames that do not follow each other in time: each shows what it holds."""
