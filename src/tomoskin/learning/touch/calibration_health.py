"""What speaks for and against a calibration of touch: frames of now, presses left out in turn, and
what labelled presses say of a fit."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import compress, product
from typing import Self

import numpy as np

from tomoskin.core import Detection, FloatArray
from tomoskin.learning.touch.locator import SHARED, Locator
from tomoskin.learning.touch.model_fit import compared
from tomoskin.learning.touch.per_channel import SURE, Envelope, evidence_of
from tomoskin.learning.touch.presses import equally_hard
from tomoskin.model.skin import Skin
from tomoskin.sensing.segment import Region

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
    unused
        Why it does not locate touches, but the fit alone does; "" where it does.
    """

    presses: int
    strangeness: float
    excluded: tuple[str, ...] = ()
    alone: bool = False
    unused: str = ""

    @property
    def known(self) -> bool:
        """Whether there were touches enough to tell."""
        return self.presses >= FEWEST

    @property
    def well(self) -> bool:
        """Whether nothing speaks against the calibration."""
        return not (self.unused or self.excluded) and not (
            self.known and self.strangeness > STRANGE
        )

    @property
    def broken(self) -> bool:
        """Whether the calibration is so strange that someone must act."""
        return not self.unused and (
            len(self.excluded) > _FEW or (self.known and self.strangeness > BROKEN)
        )

    @property
    def findings(self) -> tuple[str, ...]:
        """What differs and what would mend it, in words; else that nothing does."""
        if self.unused:
            return (self.unused,)
        return (*self._fits(), ALONE) if self.alone else self._fits()

    def _fits(self) -> tuple[str, ...]:
        reasons = []
        if self.known and self.strangeness > STRANGE:
            reasons.append(
                f"frames fit the calibration {self.strangeness:.1f} times worse than its own "
                "presses do: the skin, its electrodes or its gains have changed. Ellipses are "
                "widened. Align it by presses of today: tomoskin calibrate touch --onto C.npz"
            )
        if self.excluded:
            shown = "; ".join(self.excluded[:_SHOWN])
            reasons.append(
                f"{len(self.excluded)} rows have jumped since the calibration and are left out: "
                f"{shown}; presses of today mend that: tomoskin calibrate touch --onto"
            )
        if reasons:
            return tuple(reasons)
        if not self.known:
            return (f"touch {FEWEST} spots to see whether the calibration still fits",)
        return (
            f"touches fit the calibration as its own presses do ({self.strangeness:.1f} times as "
            "far off)",
        )


_GUESS, _GUESS_OF_FEW = 0.75, 2.5
"""Part of a guess's error above which nothing was learnt; less by the second over the number of
presses. Noise gives 0.5 to 0.85 with 8 presses, 0.8 to 0.92 with 10, 0.93 to 0.99 from 20 on."""


@dataclass(frozen=True)
class LeftOut:
    """How far a locator's positions may be trusted.

    Attributes
    ----------
    guessed
        Mean m by which presses are missed when the middle of the others is the answer.
    is_guess
        Whether the locator misses them about as far: noise alone gives such errors.
    drift
        How many times as far as the others the last eighth of the presses is missed (medians); 1
        where that may be chance.
    one_force
        Whether all presses were about equally hard. Errors and covariances then hold for such
        presses alone, and softer or harder ones are missed by more.
    """

    guessed: float
    is_guess: bool
    drift: float
    one_force: bool

    @classmethod
    def of(cls, locator: Locator) -> Self:
        """Of the presses that ``locator`` was learnt from."""
        presses, errors = locator.presses, locator.errors
        away = np.linalg.norm(presses.xy - presses.xy.mean(axis=0), axis=1)
        guessed = float(away.mean() * len(away) / max(len(away) - 1, 1))
        limit = _GUESS - _GUESS_OF_FEW / len(away)
        count = max(len(errors) // 8, _NEWEST)
        return cls(
            guessed=guessed,
            is_guess=bool(errors.mean() > limit * guessed),
            drift=_drift(errors[:-count], errors[-count:]),
            one_force=equally_hard(presses, locator.region.scaled(presses.xy)),
        )


_NEWEST = 5
"""Presses, at least, that count as the last eighth."""

_CHANCE = 5e-3
"""How often presses may be said to be missed by more where only noise makes them so."""


def _drift(before: FloatArray, newest: FloatArray) -> float:
    """How many times as far the ``newest`` presses (m,) m are missed as those ``before`` (n,) m; 1
    where as many ranks are as high by chance (Mann & Whitney 1947)."""
    from scipy.stats import mannwhitneyu  # noqa: PLC0415 - loads slowly

    if not len(before) or mannwhitneyu(newest, before, alternative="greater").pvalue > _CHANCE:
        return 1.0
    return float(np.median(newest) / max(np.median(before), np.finfo(float).tiny))


_ENOUGH_OLDER = 12
"""Presses of an older locator from which it is told whether more of them make it worse."""

_BY_CHANCE = 2.5
"""Standard errors of a mean difference that are taken for chance."""


def growth_of_errors(locator: Locator, older: Locator | None = None) -> float:
    """How many times as far the older presses are missed since the others were added.

    The presses of ``older``, by default those of the first half alone, are missed by more or less
    in ``locator``, each left out. 1 where that may be chance, and of too few presses.
    """
    if older is None:
        presses = locator.presses.first(len(locator.presses) // 2)
        if len(presses) < _ENOUGH_OLDER:
            return 1.0
        older = locator.learn(presses, locator.region, locator.pattern, locator.skin_id)
    before = older.errors
    more = locator.errors[: len(before)] - before
    if len(before) < _ENOUGH_OLDER or more.mean() < _BY_CHANCE * more.std() / len(more) ** 0.5:
        return 1.0
    return float(1 + more.mean() / before.mean())


_WORSE = 1.1
"""Growth from which more presses have made a calibration worse."""


def worse(growth: float) -> str:
    """What a ``growth`` of errors says of the newer presses; nothing where it is small."""
    if growth <= _WORSE:
        return ""
    return (
        f"since the newer presses were added, the older ones are missed {growth:.1f} times as far: "
        "the newer ones do not fit with them"
    )


_TINY = 0.12
"""Part of the sheet's extent below which labels are of another unit: ten of it make one of ours, or
twenty-five."""

_AXES = ("x and y exchanged", "x of the other sign", "y of the other sign")
_TURNS = tuple(product((False, True), repeat=3))

_CLEARLY = 4.0
"""How many times smaller squares must be with other axes, or another unit, than as given."""

_OF_ANOTHER_UNIT = 1.6
"""Times the way from the middle that labels of another unit differ by: an inch is 2.54 cm."""


def label_doubts(locator: Locator, skin: Skin) -> str:
    """What speaks for another unit or other axes of the labels than the ``skin`` has, in words.

    A sheet that answers as its model says tells where the presses were. Of others, rows answer most
    strongly near their electrodes, so that presses tell where these are.
    """
    xy, outline = locator.presses.xy, Region.of(skin).outline
    covered, extent = (float(np.ptp(points, axis=0).max()) for points in (xy, outline))
    if covered < _TINY * extent:
        return (
            f"all labels lie within {1e3 * covered:.1f} mm of each other, on a skin of "
            f"{1e3 * extent:.0f} mm: are they in inches or centimetres? "
            "Give them in metres"
        )
    region, pattern = locator.region, locator.pattern
    if pattern is None:
        return ""
    answer = compared(locator.presses.dv, skin, pattern, region)[1]
    if answer.holds:
        return _doubt_by_model(region.scaled(xy), answer.weights @ region.grid)
    rim = Envelope.of(pattern, region.scaled(skin.electrode_centres))
    return _axes_doubt(_axes_by_rim(locator, rim))


def _doubt_by_model(labels: FloatArray, there: FloatArray) -> str:
    """What speaks against labels (n, 2) in radii of presses that the model has ``there`` (n, 2)."""
    every = {turned: _missed(_turned(labels, turned), there) for turned in _TURNS}
    usual, axes = every[_TURNS[0]], min(_TURNS, key=every.__getitem__)
    if every[axes] < usual / _CLEARLY:
        return _axes_doubt(axes)
    scale = float((labels * there).sum() / (there * there).sum())
    is_near = 1 / _OF_ANOTHER_UNIT < scale < _OF_ANOTHER_UNIT
    if is_near or _missed(labels, scale * there) > usual / _CLEARLY:
        return ""
    return (
        f"the labels lie {scale:.2f} times as far from the middle as the skin's model has the "
        "presses: are they in another unit? Give them in metres"
    )


def _turned(xy: FloatArray, turned: tuple[bool, ...]) -> FloatArray:
    """Labels (n, 2) with x and y exchanged, and then of the other sign."""
    return np.asarray((xy[:, ::-1] if turned[0] else xy) * np.where(turned[1:], -1, 1))


def _missed(labels: FloatArray, there: FloatArray) -> float:
    """Median square of the way from labels (n, 2) to where they should be."""
    return float(np.median(((labels - there) ** 2).sum(axis=1)))


def _axes_by_rim(locator: Locator, rim: Envelope) -> tuple[bool, ...]:
    """By which change of the axes the strongest answers are nearest to their electrodes on the
    ``rim``; none where that is not sure."""
    features, region, xy = locator.features, locator.region, locator.presses.xy
    own, *others = _TURNS
    if len(features.rows) > SHARED:
        return own
    near, data = rim.of_rows(features.rows), features(locator.presses.dv)

    def evidence(turned: tuple[bool, ...], envelope: Envelope = near) -> float:
        return evidence_of(envelope, region.scaled(_turned(xy, turned)), data)

    best = max(others, key=evidence)
    sure = evidence(best) >= SURE + max(evidence(own), evidence(own, Envelope()))
    return best if sure else own


def _axes_doubt(axes: tuple[bool, ...]) -> str:
    """What speaks for other axes, in words; nothing where none is changed."""
    if not any(axes):
        return ""
    changes = " and ".join(compress(_AXES, axes))
    return (
        f"the labels fit the electrodes of this skin better with {changes}: check the axes of the "
        "labels, and [electrodes] first and order in the skin file"
    )


_FEWEST_FITTED = 8
"""Presses that were fitted, and part of all, from which something is said of the fit."""

_HALF = 0.5

_NOTHING = 1.0
"""m², more than any skin: nothing is known."""

_WORTH = 0.7
"""Part of the squared errors, each press left out, down to which a turn and a stretch must bring
them to be believed. Chosen on the twin's textile discs, seeds 31 to 33, turned by 0 and 14°."""

_ASTRAY = 3.0
"""Median errors beyond which a press was fitted elsewhere, and tells nothing of the others."""

_MEDIAN = float(2 * np.log(2))
"""Squared median error over the variance along an axis, of Gaussian errors in a plane."""


@dataclass(frozen=True, eq=False)
class FitCorrection:
    """From fitted positions to those that labels say: x → linear x + offset.

    Attributes
    ----------
    linear, offset
        (2, 2), and (2,) m.
    variance
        m² along an axis that errors have beyond what the fit says.
    """

    linear: FloatArray
    offset: FloatArray
    variance: float

    @classmethod
    def of(cls, fitted: FloatArray, variance: FloatArray, positions: FloatArray) -> Self:
        """Of presses ``fitted`` at (n, 2) m, NaN where none was, with the ``variance`` (n,) m² that
        the fit says, and their labels (n, 2) m."""
        known = np.flatnonzero(np.isfinite(fitted).all(axis=1))
        if len(known) < max(_FEWEST_FITTED, _HALF * len(fitted)):
            return cls(np.eye(2), np.zeros(2), _NOTHING)
        fitted, positions, said = fitted[known], positions[known], float(np.median(variance[known]))
        plain = np.linalg.norm(fitted - positions, axis=1)
        linear, offset, missed = _affine(fitted, positions)
        near = missed <= _ASTRAY * np.median(missed)
        linear, offset, missed = _affine(fitted[near], positions[near])
        if (missed @ missed) > _WORTH * (plain[near] @ plain[near]):
            linear, offset, missed = np.eye(2), np.zeros(2), plain
        beyond = float(np.median(missed)) ** 2 / _MEDIAN - said
        return cls(linear, offset, max(beyond, 0.0))

    def __call__(self, fitted: Detection) -> tuple[FloatArray, FloatArray]:
        """Position (2,) m and covariance (2, 2) m² of a fitted touch."""
        own = np.array([[fitted.sd_x**2, fitted.cov_xy], [fitted.cov_xy, fitted.sd_y**2]])
        position = self.linear @ [fitted.x, fitted.y] + self.offset
        return position, self.linear @ own @ self.linear.T + self.variance * np.eye(2)


def _affine(fitted: FloatArray, positions: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Least squares: linear (2, 2), offset (2,), and (n,) m by which each is missed when it is left
    out."""
    rows = np.column_stack([fitted, np.ones(len(fitted))])
    inverse = np.linalg.pinv(rows)
    solution = inverse @ positions
    leverage = np.clip((rows * inverse.T).sum(axis=1), 0.0, 1 - 1e-9)
    missed = np.linalg.norm(positions - rows @ solution, axis=1) / (1 - leverage)
    return solution[:2].T, solution[2], missed
