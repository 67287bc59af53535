"""A calibration from touches everywhere, without labels: rubbed, not pressed at known positions."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import ArrayLike
from threadpoolctl import threadpool_limits

from tomoskin.core import DataError, FloatArray, IntArray
from tomoskin.extras.alignment.unlabelled import UnlabelledFit, from_labels, missed_labels
from tomoskin.learning import BoolArray, Locator, Presses, Progress, labelled_touches, silent
from tomoskin.model.pattern import Pattern
from tomoskin.model.skin import Skin
from tomoskin.sensing.segment import Region

FEWEST, _MOST = 150, 800
"""Touches that are needed, and that are used: spread evenly over those that were made."""

_WARPED, _UNSURE = 0.26, 1.2
"""How far a position may be off, in each direction: times the way from where the electrodes'
order alone puts it, and times that by which the fits disagree. Chosen on two skins."""

_MODEL = 0.035
"""The same, in radii, of positions that are the model's. Chosen on the twin."""

_ALIKE = 0.27
"""Correlation with the skin's own responses below which the data are not of this skin."""

_APART = 0.19
"""Way, in radii, by which fits that assume different things may differ (root mean square)."""

_MOVED = 0.45
"""Mean way, in radii, from where the electrodes' order alone puts the touches: 1.25 times the
most of the two skins that settings were chosen on."""

_ENOUGH = 20
"""Labels that align the touches by themselves where the electrodes' order misleads."""

_HARDER = 1.0
"""Logarithm by which a touch may be harder or softer than those that were made, where the changes
of a sheet are in proportion to the force. Chosen on the twin's seeds 1 to 3."""

_GOLDEN = 0.6180339887
"""Multiples of it are spread evenly between whole numbers."""

_QUIET = 3.0
"""An electrode that no touch came near answers in its largest answers less than so many times as
strongly as usual, by itself times as a part of the frame: 1.8 to 2.6 there, 3.4 and more elsewhere
on the twin and a hydrogel; a patterned skin may seem to be touched in part, and the reverse."""

_NEAR = 0.95
_CONTRADICTED = 0.5
"""Way in radii by which a label may differ from where the touch is found without labels."""

_AGREED = 1.5
"""Deviations, of one direction, by which labels together may differ from the model's positions."""


@dataclass(frozen=True, eq=False)
class Rubbing:
    """Touches everywhere on a skin, and where they were; made by :meth:`of`.

    Attributes
    ----------
    skin, pattern
        What was touched, and what was measured.
    presses
        The touches that are used, with the positions that were found and their covariance.
    disagreement, moved
        m by which fits that assume different things differ (root mean square), and mean way from
        where the electrodes' order alone puts the touches; both 0 where neither was asked.
    alike
        Correlation of the data with what the skin's model expects.
    modelled
        Whether the sheet answers as its model says, and the positions are the model's: those of
        the sheet's response, which friction drags behind a finger that slides.
    quiet
        Electrodes, from 0, that touches seem not to have come near: on a patterned skin that may
        be so though they have, and does not refuse.
    contradicted
        Labelled frames that are found far from their label.
    by_labels
        Whether labels did without the model and the electrodes' order, which do not hold.
    """

    skin: Skin
    pattern: Pattern
    presses: Presses
    disagreement: float
    moved: float
    alike: float
    modelled: bool
    quiet: tuple[int, ...]
    contradicted: tuple[int, ...]
    by_labels: bool = False

    @classmethod
    def of(
        cls,
        dv: ArrayLike,
        skin: Skin,
        xy: ArrayLike | None = None,
        *,
        pattern: Pattern | None = None,
    ) -> Self:
        """Find where the touches were.

        Parameters
        ----------
        dv
            (n, n_meas) touched frame minus untouched frame, one touch each, in any one unit; NaN
            is missing.
        skin
            Its outline, and where its electrodes are.
        xy
            (n, 2) m, NaN where a touch has no label; None: no touch has one.
        pattern
            What was measured, where that is not the skin's own pattern.

        Raises
        ------
        DataError
            For fewer than 150 touches, arrays that do not belong together, labels outside the
            skin, and electrodes that the skin does not have.
        """
        table = pattern or skin.pattern()
        if table.n_electrodes != skin.pattern().n_electrodes:
            raise DataError(
                f"the pattern has {table.n_electrodes} electrodes, but the skin has "
                f"{skin.pattern().n_electrodes}",
                hint="give the skin that was rubbed: --skin",
            )
        data, labels = labelled_touches(dv, xy, table.n_meas)
        if len(data) < FEWEST:
            raise DataError(
                f"expected at least {FEWEST} touches, got {len(data)}",
                hint="rub the whole skin with one finger for a minute",
            )
        with threadpool_limits(1):
            return cls._of(data, labels, skin, table)

    @classmethod
    def _of(cls, dv: FloatArray, xy: FloatArray, skin: Skin, pattern: Pattern) -> Self:
        region = Region.of(skin)
        given = np.flatnonzero(np.isfinite(xy).all(axis=1))
        Presses.of_more(dv[given], xy[given]).within(region)
        evenly = np.linspace(0, len(dv) - 1, min(len(dv), _MOST)).astype(int)
        chosen = np.union1d(given, evenly)
        dv, xy = dv[chosen], xy[chosen]
        labels = region.scaled(xy)
        labelled = np.flatnonzero(np.isfinite(labels).all(axis=1))
        alone = UnlabelledFit.of(dv, skin, pattern, region, np.full(xy.shape, np.nan))
        far = _contradicting(alone, labels, labelled)
        rubbed = cls(
            skin,
            pattern,
            Presses.checked(dv, region.metres(alone.positions), spread=_spread(alone, region)),
            region.unit * alone.disagreement,
            region.unit * alone.moved,
            alone.alike,
            alone.modelled,
            quiet_electrodes(dv, pattern),
            tuple(chosen[far].tolist()),
        )
        if not len(labelled):
            return rubbed
        if rubbed.holds:
            fit = UnlabelledFit.of(dv, skin, pattern, region, labels)
            apart = region.unit * fit.disagreement
            presses = _presses(dv, xy, region.metres(fit.positions), _spread(fit, region))
            return replace(rubbed, presses=presses, disagreement=apart)
        return rubbed._by_labels(xy) if len(labelled) >= _ENOUGH else rubbed

    def _by_labels(self, xy: FloatArray) -> Self:
        """The same from labels ``xy`` (n, 2) m alone, unless they contradict each other."""
        dv, region = self.presses.dv, Region.of(self.skin)
        labels = region.scaled(xy)
        missed = missed_labels(dv, labels, region, self.pattern)
        if missed > _CONTRADICTED:
            return self
        positions = from_labels(dv, labels, region, self.pattern)
        spread = np.tile(0.5 * (region.unit * missed) ** 2 * np.eye(2), (len(dv), 1, 1))
        presses = _presses(dv, xy, region.metres(positions), spread)
        return replace(self, presses=presses, modelled=False, contradicted=(), by_labels=True)

    @property
    def holds(self) -> bool:
        """Whether the positions can be believed."""
        doubtful = self.alike < _ALIKE or self.contradicted or self._unsure
        return self.by_labels or not doubtful

    @property
    def _unsure(self) -> bool:
        unit = Region.of(self.skin).unit
        return self.disagreement > _APART * unit or self.moved > _MOVED * unit

    @property
    def findings(self) -> tuple[str, ...]:
        """What speaks against the positions and what would mend it, in words."""
        notes = []
        if self.alike < _ALIKE and not self.by_labels:
            notes.append(
                "the voltages do not change as this skin's model predicts: the pattern or the "
                "skin may be another one, or wires may be swapped (tomoskin calibrate mapping)"
            )
        if self._unsure and not self.by_labels:
            notes.append(
                "the touches do not say where they were: fits that assume different things differ "
                f"by {1e3 * max(self.disagreement, self.moved):.0f} mm; label at least {_ENOUGH} "
                "touches, or press known positions (tomoskin calibrate touch)"
            )
        if self.quiet:
            names = ", ".join(f"E{e + 1}" for e in self.quiet)
            notes.append(f"probably no touch came near {names}: rub the whole skin, out to its rim")
        if self.contradicted:
            shown = ", ".join(map(str, self.contradicted[:10]))
            notes.append(
                f"the labels of frames {shown} contradict the positions found without labels: "
                "check the labels, and [electrodes] first and order in the skin file"
            )
        return tuple(notes)

    @property
    def labelled(self) -> int:
        """How many of the touches that are used had a label."""
        return int((~self.presses.spreads.any(axis=(1, 2))).sum())

    @property
    def deviation(self) -> float:
        """m by which positions that were found are uncertain in each direction (median)."""
        size = np.sqrt(np.trace(self.presses.spreads, axis1=1, axis2=2) / 2)
        return float(np.median(size[size > 0]))

    @property
    def text(self) -> str:
        """What was found, in a sentence."""
        return (
            f"{len(self.presses)} touches used, {self.labelled} of them labelled; the other "
            f"positions are uncertain by about {1e3 * self.deviation:.1f} mm in each direction, "
            "and a few labelled presses make them better"
        )

    def locator(self, progress: Progress = silent) -> Locator:
        """A locator that has learnt from the touches. Raises DataError where they do not hold."""
        if not self.holds:
            raise DataError("; ".join(self.findings))
        region, presses = Region.of(self.skin), self.presses
        if self.modelled:
            # What is off in each frame by itself is in the left-out errors.
            shared = (_MODEL * region.unit) ** 2 * np.eye(2)
            spread = np.where(presses.spreads.any(axis=(1, 2), keepdims=True), shared, 0.0)
            dv = _harder_and_softer(presses.dv)
            presses = replace(presses, dv=dv, spread=spread, modelled=True)
        return Locator.learn(presses, region, self.pattern, self.skin.identity, progress)


def _presses(dv: FloatArray, xy: FloatArray, positions: FloatArray, spread: FloatArray) -> Presses:
    """Frames at labels ``xy`` (n, 2) m, without spread; at ``positions`` where these are NaN."""
    known: BoolArray = np.asarray(np.isfinite(xy).all(axis=1))
    spread = np.where(known[:, None, None], 0.0, spread)
    return Presses.checked(dv, np.where(known[:, None], xy, positions), spread=spread)


def _contradicting(fit: UnlabelledFit, labels: FloatArray, labelled: IntArray) -> IntArray:
    """(k,) those of the frames ``labelled`` whose labels (n, 2) in radii are far from where they
    were found; all of them where together they speak against the skin's model."""
    away = fit.positions[labelled] - labels[labelled]
    spread = np.trace(fit.spread[labelled], axis1=1, axis2=2) / 2 + _MODEL**2
    if fit.modelled and len(away) and np.mean(away**2) > _AGREED**2 * spread.mean():
        return labelled
    return np.asarray(labelled[np.linalg.norm(away, axis=1) > _CONTRADICTED])


def _spread(fit: UnlabelledFit, region: Region) -> FloatArray:
    """(n, 2, 2) m² covariance of positions that were found."""
    warped = _MODEL if fit.modelled else _WARPED * fit.moved
    beyond = warped**2 + (_UNSURE * fit.disagreement) ** 2
    return np.asarray(region.unit**2 * (fit.spread + beyond * np.eye(2)))


def _harder_and_softer(dv: FloatArray) -> FloatArray:
    """Frames (n, k) as if each had been touched harder or softer: one finger has one force."""
    between = np.modf(_GOLDEN * np.arange(len(dv)))[0]
    return np.asarray(dv * np.exp(_HARDER * (2 * between - 1))[:, None])


def quiet_electrodes(dv: FloatArray, pattern: Pattern) -> tuple[int, ...]:
    """Electrodes that no touch of ``dv`` (n, n_meas) seems to have come near.

    Their measurements hardly ever answer more strongly than usual, neither by themselves nor as a
    part of the frame: the gain of an electrode does not matter.
    """
    sizes = np.abs(dv)
    activity = np.column_stack(
        [
            np.nanmean(sizes[:, (pattern.measure == electrode).any(axis=1)], axis=1)
            for electrode in np.unique(pattern.measure)
        ]
    )
    part = activity / activity.sum(axis=1, keepdims=True)
    above = [np.nanquantile(x, _NEAR, axis=0) / np.nanmedian(x, axis=0) for x in (activity, part)]
    return tuple(np.unique(pattern.measure)[above[0] * above[1] < _QUIET].tolist())
