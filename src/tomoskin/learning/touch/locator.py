"""The locator: labelled presses → where a frame's touch is, and how sure that is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike
from threadpoolctl import threadpool_limits

from tomoskin.core import Detection, FloatArray
from tomoskin.learning.kind import Progress, silent
from tomoskin.learning.touch.gaussian_process import squared_distances
from tomoskin.learning.touch.per_channel import Envelope, likeliest_envelope, rings
from tomoskin.learning.touch.posterior import Estimates
from tomoskin.learning.touch.presses import Features, Presses, Strength, frames, mean_about
from tomoskin.learning.touch.session_alignment import SessionAlignment
from tomoskin.learning.touch.stacking import (
    NINE_IN_TEN,
    CalibratedCovariance,
    Remark,
    Stacking,
    outliers,
    squared_lengths,
    twins,
)
from tomoskin.model.pattern import Pattern
from tomoskin.model.skin import Skin
from tomoskin.sensing.segment import Region

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
        region = Region.of(skin) if skin else Region.around(presses.xy)
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
        between = squared_distances(data, data)
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

    def in_session(self, dv: ArrayLike, xy: ArrayLike | None = None) -> Self:
        """Locator for another session, from its frames (n, n_meas) of one touch each.

        ``xy`` (n, 2) m where a label is known, rows of NaN otherwise. Where the session is as the
        calibration was only labels are added, and where it cannot be aligned the locator stays
        as it was: see :class:`SessionAlignment`, which says so. Raises DataError as that does.
        """
        alignment = SessionAlignment.of(self, dv, xy)
        return self.aligned(alignment) if alignment.holds else self

    def strangeness(self, dv: ArrayLike) -> FloatArray:
        """(n,) how many times worse than left-out presses frames (n, n_meas) fit the maps.

        About one where nothing has changed. Raises DataError as :meth:`predict`.
        """
        return self.estimates(self.features(frames(dv, self.presses.dv.shape[1])))[2]

    def aligned(self, alignment: SessionAlignment, progress: Progress = silent) -> Self:
        """Locator that has learnt from the frames of an alignment, with their labels.

        Where that is not needed, the labels that were given are added to its own.
        """
        presses, given = alignment.presses, alignment.labelled
        if not alignment.needed:
            return self.updated(given.dv, given.xy) if len(given) else self
        return self.learn(presses, self.region, self.pattern, self.skin_id, progress)

    def strength(self, dv: ArrayLike) -> FloatArray:
        """(n,) strength of each frame's touch.

        In the unit of the labels; without labels, how many times as large the frame is as those
        of the presses at its place.
        """
        data = frames(dv, self.presses.dv.shape[1])
        guess = self.region.scaled(self.predict(data)[0])
        return self.power(data, guess)

    def updated(
        self,
        dv: ArrayLike,
        xy: ArrayLike,
        strength: ArrayLike | None = None,
        progress: Progress = silent,
    ) -> Self:
        """Locator that has learnt from more presses beside its own."""
        presses = self.presses.and_then(Presses.of_more(dv, xy, strength))
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
