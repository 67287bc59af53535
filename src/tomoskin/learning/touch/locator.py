"""The locator: labelled presses → where a frame's touch is, and how sure that is; stacking, how
much each of two estimates of a position counts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import minimize
from scipy.special import chdtri
from threadpoolctl import threadpool_limits

from tomoskin.core import Detection, FloatArray
from tomoskin.learning.kind import Progress, silent
from tomoskin.learning.touch import gaussian_process as gp
from tomoskin.learning.touch.per_channel import Envelope, likeliest_envelope, rings
from tomoskin.learning.touch.posterior import Estimates
from tomoskin.learning.touch.presses import Features, Presses, Strength, frames, mean_about
from tomoskin.model.pattern import Pattern
from tomoskin.model.skin import Skin
from tomoskin.sensing.segment import Region
from tomoskin.sensing.track import likeliest_lag

_SPREAD = 1e-3
"""Deviation, in radii of the region, below which no place is known."""

_FREEDOM = 5.0
"""Degrees of freedom of the errors: their tail is heavier than a Gaussian's."""

NINE_IN_TEN = float(chdtri(2, 0.1))
"""Squared length within which nine in ten of a Gaussian's errors lie."""

_RECENT, _FEWEST = 8, 30
"""The last eighth of the presses, or so many, tell whether the skin has changed."""

_CHANCE = 1.6
"""By which few presses may miss farther than many without any change."""

_SPENT = 7
"""Presses that the choice of settings has used up: left-out errors of few presses flatter."""

_FOLDED = 0.88
"""Part of the variance of left-out errors that those of presses to come have: left-out ones are
estimated from four fifths of the presses. This and the number before were chosen on noPattern,
radial, cam09_05 and the 8 electrodes of eskin_hydrogel_round, 25 to 200 presses."""


@dataclass(frozen=True)
class CalibratedCovariance:
    """Covariance of an answer: a part of the posterior's own, and the same for all, with a factor
    by which nine ellipses in ten hold their press.
    """

    posterior: float
    everywhere: float

    @classmethod
    def of(cls, errors: FloatArray, posterior: FloatArray) -> Self:
        """Learn from left-out ``errors`` (n, 2), and the ``posterior`` (n, 2, 2) of each.

        The parts are those at which the errors are likeliest (a Student density); the common
        factor is split-conformal (Vovk, Gammerman & Shafer 2005). The errors are in the order of
        the presses: where the last ones are larger, the skin has changed, and they count alone.
        """
        size = float((errors**2).mean()) + _SPREAD**2

        def cost(logs: FloatArray) -> float:
            cov = cls(*np.exp(logs))(posterior)
            far = squared_lengths(errors, cov)
            heavy = (_FREEDOM + 2) * np.log1p(far / _FREEDOM)
            return float((np.log(np.linalg.det(cov)) + heavy).sum()) + 0.05 * float(logs @ logs)

        start = np.array([-1.0, np.log(0.3 * size)])
        optimum = np.exp(minimize(cost, start, method="Nelder-Mead", options={"maxiter": 150}).x)
        far = squared_lengths(errors, cls(*optimum)(posterior))
        last = far[-max(len(far) // _RECENT, _FEWEST) :]
        factor = max(gp.nine_in_ten(far), gp.nine_in_ten(last) / _CHANCE) / NINE_IN_TEN
        spent = _FOLDED * (len(errors) + _SPENT) / max(len(errors) - _SPENT, 1)
        return cls(*(float(x) for x in factor * spent * optimum))

    def __call__(self, posterior: FloatArray) -> FloatArray:
        """The covariance (n, 2, 2) of each position, in m²."""
        common = (self.everywhere + _SPREAD**2) * np.eye(2)
        return np.asarray(self.posterior * posterior + common)


def squared_lengths(errors: FloatArray, covariance: FloatArray) -> FloatArray:
    """(n,) squared Mahalanobis lengths."""
    solved = np.linalg.solve(covariance, errors[:, :, None])[:, :, 0]
    return np.asarray((errors * solved).sum(axis=1))


_TERMS = (("features", "estimate"), ("features",), ("estimate",))

_NEAR = 0.5
"""Unit of the estimates' distances, in radii of the region."""

_BEFORE, _WORTH = 0.36, 8
"""Part of the process before any press, and as many presses it counts for: from few, the part is
learnt badly."""


@dataclass(frozen=True, eq=False)
class Stacking:
    """The weighted mean of the maps' estimate and of a process on features and estimate.

    Stacked generalisation (Wolpert 1992): the estimates that the process learns from, and its
    ``part`` of the answer, come from presses that were left out. ``left_out`` (n, 2) is what each
    press would be told without itself.
    """

    features: FloatArray
    estimates: FloatArray
    unit: float
    process: gp.Process
    part: float
    left_out: FloatArray

    @classmethod
    def of(
        cls,
        features: FloatArray,
        between: FloatArray,
        estimates: FloatArray,
        xy: FloatArray,
    ) -> Self:
        """Learn from ``features`` (n, k), their squared distances ``between`` each other (n, n),
        held-out ``estimates`` (n, 2) and places ``xy``."""
        unit = _usual(between)
        squares = {
            "features": between / unit,
            "estimate": gp.squared_distances(estimates, estimates) / _NEAR**2,
        }
        process = gp.Process.of(_TERMS, squares, xy)
        part = _part(estimates, process.left_out, xy)
        left_out = estimates + part * (process.left_out - estimates)
        return cls(features, estimates, unit, process, part, left_out)

    @cached_property
    def _norms(self) -> FloatArray:
        return gp.squared_norms(self.features)

    def __call__(self, features: FloatArray, estimates: FloatArray) -> FloatArray:
        """(m, 2) places of frames with ``features`` (m, k) of which the maps say ``estimates``."""
        squares = {
            "features": gp.squared_distances(features, self.features, self._norms) / self.unit,
            "estimate": gp.squared_distances(estimates, self.estimates) / _NEAR**2,
        }
        return estimates + self.part * (self.process(squares) - estimates)


def _usual(between: FloatArray) -> float:
    """The median of squared distances, without those of presses that are alike."""
    return float(np.median(between[between > 0])) if (between > 0).any() else 1.0


def _part(estimates: FloatArray, others: FloatArray, xy: FloatArray) -> float:
    """Part of the ``others`` of least squared error; far-off presses weigh less (Huber)."""
    errors = np.minimum(*(np.linalg.norm(said - xy, axis=1) for said in (estimates, others)))
    weigh = 1 / np.maximum(errors, np.median(errors) + 1e-9)[:, None]
    way = others - estimates
    best = float((weigh * way * (xy - estimates)).sum() / ((weigh * way**2).sum() + _SPREAD**2))
    learnt = len(xy) / (len(xy) + _WORTH)
    return learnt * min(max(best, 0.0), 1.0) + (1 - learnt) * _BEFORE


_SAME = 1e-6
"""Squared distance of features, in parts of the usual, at which two presses are one."""

_APART = 0.05
_FAR, _UNLIKELY = 0.3, 23.0
"""An outlier is so far off, in radii of the region, and its squared Mahalanobis length so large
(one in 100,000 of a Gaussian's)."""


@dataclass(frozen=True)
class Remark:
    """Press ``row``, counted from 0, and what is wrong with its label."""

    row: int
    reason: str


def twins(between: FloatArray, positions: FloatArray, unit: float) -> list[Remark]:
    """Presses with the same data as an earlier one, at another place, by the squared distances
    ``between`` their features (n, n)."""
    usual = _usual(between)
    apart = gp.squared_distances(positions, positions)
    pairs = np.argwhere(np.triu((between < _SAME * usual) & (apart > _APART**2), 1))
    remarks: dict[int, Remark] = {}
    for first, second in pairs.tolist():
        far = 1e3 * unit * float(np.sqrt(apart[first, second]))
        remarks.setdefault(
            second, Remark(second, f"has the same data as press {first}, {far:.0f} mm away")
        )
    return list(remarks.values())


def outliers(
    estimates: FloatArray, positions: FloatArray, covariance: FloatArray, unit: float
) -> list[Remark]:
    """Presses that lie far from where the others say they are: ``estimates`` (n, 2) left out."""
    error = estimates - positions
    length = np.linalg.norm(error, axis=1)
    rows = np.flatnonzero((squared_lengths(error, covariance) > _UNLIKELY) & (length > _FAR))
    return [
        Remark(row, f"according to the other presses it was {1e3 * unit * length[row]:.0f} mm away")
        for row in rows.tolist()
    ]


_STEPS = 4

_PLACES = 600
"""Positions in the grid; what is between them is their mean."""

SHARED = 256
"""Measurements above which it is not asked where their electrodes are: so many tell enough."""

_MISSING = 2.0
"""Power of the part of the rows that a frame has, by which its covariance is divided: filled in,
the others say little. Chosen on the twin's textile disc without one of 8 electrodes, seeds 1 to 3.
"""

_WIDEST = 2.0
"""Deviation, in radii of the region, at which nothing is known of a place: another skin may be
larger."""


def _bounded(covariance: FloatArray) -> FloatArray:
    """Covariances (n, 2, 2), none larger than not knowing the place."""
    size = np.sqrt(np.trace(covariance, axis1=1, axis2=2) / 2)
    return np.asarray(covariance * np.minimum(_WIDEST / size, 1.0)[:, None, None] ** 2)


def _label_spread(presses: Presses, region: Region, positions: FloatArray) -> FloatArray | float:
    """(n, 2, 2) usual covariance of the labels about ``positions`` (n, 2), both in radii."""
    if presses.spread is None:
        return 0.0
    return mean_about(positions, region.scaled(presses.xy), presses.spread / region.unit**2)


@dataclass(frozen=True, eq=False)
class Locator:
    """Places of single touches, learnt from labelled presses; made by :meth:`fit`.

    Attributes
    ----------
    presses
        What it was learnt from.
    region
        Where a touch may be: the skin, or where the presses were.
    pattern
        What was measured, or None where it is not known.
    skin_id
        Identity of the skin, "" where it is not known.
    held
        Part of the presses that lie in their own 90 % ellipse when they are left out.
    remarks
        Labels that the other presses contradict.
    """

    presses: Presses
    region: Region
    pattern: Pattern | None
    skin_id: str
    features: Features
    estimates: Estimates
    stacking: Stacking
    calibrated: CalibratedCovariance
    power: Strength
    held: float
    remarks: tuple[Remark, ...]

    @classmethod
    def fit(
        cls,
        dv: ArrayLike,
        xy: ArrayLike,
        *,
        pattern: Pattern | None = None,
        skin: Skin | None = None,
        strength: ArrayLike | None = None,
        progress: Progress = silent,
    ) -> Self:
        """Learn from presses.

        Parameters
        ----------
        dv
            (n, n_meas) pressed frame minus untouched frame, in any one unit; NaN is missing.
        xy
            (n, 2) m, the place of each press, in the order in which they were made.
        pattern, skin
            What was measured and on what; the skin's outline bounds where a touch may be.
        strength
            (n,) force or depth of each press in any unit; without it, see :meth:`strength`.
        progress
            Told how much of how much is done.

        Raises
        ------
        DataError
            For arrays that do not belong together, fewer than six presses, labels outside the
            skin, presses on one line, data that never change.
        """
        table = pattern or (skin.pattern() if skin else None)
        presses = Presses.checked(dv, xy, strength)
        if table is not None:
            frames(presses.dv, table.n_meas)
        hull = Region.around(presses.xy)  # refuses presses on one line
        region = Region.of(skin) if skin else hull
        skin_id = skin.identity if skin else ""
        return cls.learn(presses.within(region), region, table, skin_id, progress)

    @classmethod
    def learn(
        cls,
        presses: Presses,
        region: Region,
        pattern: Pattern | None = None,
        skin_id: str = "",
        progress: Progress = silent,
    ) -> Self:
        """Learn from checked presses in a region, of a pattern and a skin where they are known."""
        with threadpool_limits(1):  # many small products: more threads only wait for each other
            return cls._learnt(presses, region, (pattern, skin_id), progress)

    @classmethod
    def _learnt(
        cls,
        presses: Presses,
        region: Region,
        origin: tuple[Pattern | None, str],
        progress: Progress,
    ) -> Self:
        positions = region.scaled(presses.xy)
        features = Features.of(presses.dv)
        data = features(presses.dv)
        progress(0, _STEPS)
        envelope = Envelope()
        if origin[0] is not None and len(features.rows) <= SHARED:
            around = rings(origin[0], region.scaled(region.outline))
            of_rows = (ring.of_rows(features.rows) for ring in around)
            envelope = likeliest_envelope(of_rows, positions, data)
        grid = region.lattice(_PLACES)
        estimates = Estimates.of(data, positions, grid, envelope)
        progress(1, _STEPS)
        between = gp.squared_distances(data, data)
        stacking = Stacking.of(data, between, estimates.left_out, positions)
        progress(2, _STEPS)
        errors = stacking.left_out - positions
        calibrated = CalibratedCovariance.of(errors, estimates.left_out_spread)
        covariance = calibrated(estimates.left_out_spread)
        held = float(np.mean(squared_lengths(errors, covariance) < NINE_IN_TEN))
        remarks = (
            *twins(between, positions, region.unit),
            *outliers(stacking.left_out, positions, covariance, region.unit),
        )
        progress(3, _STEPS)
        power = Strength.of(presses, stacking.left_out)
        progress(_STEPS, _STEPS)
        return cls(
            presses,
            region,
            *origin,
            features,
            estimates,
            stacking,
            calibrated,
            power,
            held,
            remarks,
        )

    def predict(self, dv: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Place (n, 2) m and its covariance (n, 2, 2) m² for frames (n, n_meas).

        A frame that fits the presses worse than they fit each other has a larger covariance. Values
        that are not finite are left out. Raises DataError for another number of rows, and for a
        frame without any value that is used.
        """
        return self.posterior(dv)[:2]

    def posterior(self, dv: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
        """What :meth:`predict` and :meth:`strangeness` say of frames (n, n_meas)."""
        given = frames(dv, self.presses.dv.shape[1])
        data = self.features(given)
        guess, spread, strangeness = self.estimates(data)
        answer = self.stacking(data, guess)
        covariance = self.calibrated(spread)
        present = np.isfinite(given[:, self.features.rows]).mean(axis=1)
        wide = _bounded(
            present[:, None, None] ** -_MISSING * covariance
            + self.estimates.doubt(strangeness)[:, None, None] ** 2 * np.eye(2)
            + _label_spread(self.presses, self.region, answer)
        )
        return self.region.metres(answer), self.region.unit**2 * wide, strangeness

    def sliding(self, time: Sequence[float] | FloatArray, dv: ArrayLike) -> Self:
        """The same that knows by how much the sheet lags behind a finger that slides: one that did
        at each ``time`` (n,) s, in frames (n, n_meas). Raises DataError as :meth:`predict`."""
        lag = likeliest_lag(time, self.predict(dv)[0])
        return replace(self, presses=replace(self.presses, slide_lag=lag))

    def strangeness(self, dv: ArrayLike) -> FloatArray:
        """(n,) how many times worse than left-out presses frames (n, n_meas) fit the maps.

        About one where nothing has changed. Raises DataError as :meth:`predict`.
        """
        return self.estimates(self.features(frames(dv, self.presses.dv.shape[1])))[2]

    def strength(self, dv: ArrayLike) -> FloatArray:
        """(n,) strength of each frame's touch.

        In the unit of the labels; without labels, how many times as large the frame is as those
        of the presses at its place.
        """
        data = frames(dv, self.presses.dv.shape[1])
        guess = self.region.scaled(self.predict(data)[0])
        return self.power(data, guess)

    def updated(self, dv: ArrayLike, xy: ArrayLike, progress: Progress = silent) -> Self:
        """Locator that has learnt from more presses beside its own."""
        presses = self.presses.and_then(Presses.of_more(dv, xy))
        region = self.region if self.skin_id else Region.around(presses.xy)
        return self.learn(presses.within(region), region, self.pattern, self.skin_id, progress)

    @property
    def errors(self) -> FloatArray:
        """(n,) m by which each press is missed when it is left out."""
        return np.asarray(
            self.region.unit
            * np.linalg.norm(self.stacking.left_out - self.region.scaled(self.presses.xy), axis=1)
        )

    def next_place(self) -> FloatArray:
        """(2,) m where the next labelled press tells most: the maps are least certain there."""
        return self.region.metres(self.estimates.least_known)


def detection_at(position: FloatArray, covariance: FloatArray, strength: float) -> Detection:
    """A touch at a position (2,) m with a covariance (2, 2) m², as presses tell it."""
    (x, y), (sd_x, sd_y) = position.tolist(), np.sqrt(np.diag(covariance)).tolist()
    nothing = np.empty(0, dtype=np.int64)
    return Detection(x, y, sd_x, sd_y, np.nan, strength, nothing, cov_xy=float(covariance[0, 1]))
