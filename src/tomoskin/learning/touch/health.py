"""How far frames of now are from what a calibration of touch was learnt on, and what mends that."""

from __future__ import annotations

from dataclasses import dataclass

STRANGE = 1.5
"""How many times worse than its own presses frames may fit a calibration unsaid."""

BROKEN = 3.0
"""How many times worse someone must act: what a textile sheet remembers makes it up to 1.4 (ten
seeds of the twin, 50 touches after up to 40 presses that were learnt from)."""

FEWEST = 5
"""Presses before which nothing is said."""

_FEW = 3
"""Rows that may be left out without that someone must act: on the twin one of 40 was left out for
some touches without need in four of six sessions."""

_SHOWN = 20


ALONE = (
    "the calibration alone locates touches, one at a time: none are fitted, since the voltages do "
    'not fit the skin\'s model, or its [touch] method is "image"'
)
"""What a calibration without a fit says of itself."""


@dataclass(frozen=True, slots=True)
class CalibrationHealth:
    """How the last touches fit the calibration that locates them.

    Attributes
    ----------
    presses
        Touches that this rests on: those at one spot in a row count once.
    strangeness
        How many times worse than its own presses they fit it (median).
    excluded
        Measurements that have jumped since, in words; they are left out.
    alone
        Whether it locates the strongest region of the image, without a fit.
    """

    presses: int
    strangeness: float
    excluded: tuple[str, ...] = ()
    alone: bool = False

    @property
    def known(self) -> bool:
        """Whether there were touches enough to tell."""
        return self.presses >= FEWEST

    @property
    def well(self) -> bool:
        """Whether nothing speaks against the calibration."""
        return not self.excluded and not (self.known and self.strangeness > STRANGE)

    @property
    def broken(self) -> bool:
        """Whether someone must act."""
        return len(self.excluded) > _FEW or (self.known and self.strangeness > BROKEN)

    @property
    def findings(self) -> tuple[str, ...]:
        """What differs and what would mend it, in words; else that nothing does."""
        return (*self._fits(), ALONE) if self.alone else self._fits()

    def _fits(self) -> tuple[str, ...]:
        found = []
        if self.known and self.strangeness > STRANGE:
            found.append(
                f"frames fit the calibration {self.strangeness:.1f} times worse than its own "
                "presses do: the skin, its electrodes or its gains have changed. Ellipses are "
                "widened. Touch the skin all over and align it: tomoskin calibrate touch --onto "
                "C.npz --unlabelled"
            )
        if self.excluded:
            shown = "; ".join(self.excluded[:_SHOWN])
            found.append(
                f"{len(self.excluded)} rows have jumped since the calibration and are left out: "
                f"{shown}; presses of today mend that: tomoskin calibrate touch --onto"
            )
        if found:
            return tuple(found)
        if not self.known:
            return (f"touch {FEWEST} spots to see whether the calibration still fits",)
        return (
            f"touches fit the calibration as its own presses do ({self.strangeness:.1f} times as "
            "far off)",
        )
