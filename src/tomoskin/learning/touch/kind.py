"""The kind of calibration that tells where a touch is, from labelled presses.

Keys of the .npz: ``kind``, ``version``; ``dv`` (n, n_meas), ``xy_m`` (n, 2), optional ``strength``
(n,) and, of labels that were estimated, ``spread_m2`` (n, 2, 2); ``outline_m`` (k, 2); ``drive``,
``measure`` (n_meas, 2), ``n_electrodes``; ``pattern``,
``skin`` identities, ``skin_name``. What was learnt is learnt again when the file is read, which
gives the same locator: a file outlives the method.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import Arrays, DataError, Detection, FloatArray, IntArray, real_numbers
from tomoskin.learning.kind import (
    Applied,
    Calibration,
    Conditions,
    FrameView,
    Kind,
    Progress,
    located,
)
from tomoskin.learning.touch.correction import FitCorrection
from tomoskin.learning.touch.health import CalibrationHealth
from tomoskin.learning.touch.locator import Locator
from tomoskin.learning.touch.lost_rows import LIVE
from tomoskin.learning.touch.presses import Presses
from tomoskin.learning.touch.standing import Standing
from tomoskin.learning.touch.watch import Watch
from tomoskin.model.pattern import Pattern
from tomoskin.model.skin import Skin
from tomoskin.sensing.segment import Region

_ALL = 0.999
"""Part of a measurement that is taken for all of it."""

_EVERY = 8
"""Of the frames in which a touch stands so many are one from which something is concluded."""

_TRIED = 60
"""Presses that a fit is tried on: each takes a millisecond."""

_SAME_SHAPE = 1e-4
"""Outlines within so many metres of each other are one."""


class LocatedTouch(Applied):
    """Detections tell that there are touches, labelled presses where each of them is.

    Of several fitted touches, each is located in the frame without what the others change. Regions
    of an image tell nothing of that: then the strongest is located, as if it were the only one.
    Measurements that have jumped since the presses are left out where frames do not fit with them.
    """

    def __init__(self, locator: Locator, correction: FitCorrection | None) -> None:
        self._correction = correction
        self._watch = Watch(locator, LIVE)
        self._standing = Standing()
        self._stood = 0

    def locate(self, view: FrameView, detections: list[Detection]) -> list[Detection]:
        """The detections, each at the position that the presses tell."""
        if not detections:
            self._standing.clear()
            self._stood = 0
            return []
        # The presses were learnt with all that is in them: nothing is taken out here either.
        differences = view.differences
        dv = np.where(_excluded(differences.nuisance), np.nan, differences.change)
        if not np.isfinite(dv).any():
            return []
        mean = self._standing.push(dv)
        correct = self._correction
        if view.others is None or correct is None:
            (position,), (covariance,) = self._watch(mean, settled=self._settled())
            return [_at(detections[0], position, covariance)]
        settled = len(detections) == 1 and self._settled()
        answers = zip(*self._watch(mean - view.others, settled=settled), strict=True)
        return [
            _at(detection, *_together(correct(detection), answer, several=len(detections) > 1))
            for detection, answer in zip(detections, answers, strict=True)
        ]

    def _settled(self) -> bool:
        """Whether the touch stands still, now and then."""
        stands = self._standing.stands
        self._stood += stands
        return stands and self._stood % _EVERY == 1

    def read(
        self, view: FrameView, detections: list[Detection], *, touched: bool
    ) -> CalibrationHealth:
        """How the last touches fit the presses."""
        del view, detections, touched
        return replace(self._watch.health, alone=self._correction is None)


def _together(
    fitted: tuple[FloatArray, FloatArray], learnt: tuple[FloatArray, FloatArray], *, several: bool
) -> tuple[FloatArray, FloatArray]:
    """What a fit and the presses, each a position (2,) m and a covariance (2, 2) m², say together.

    What they differ by beyond their covariances widens them (the moment estimator of DerSimonian
    and Laird 1986). Of one touch it is the fit's error: the presses were tried on labels. Of
    ``several`` it is both's: the presses see what the fit has left of the others.
    """
    (here, own), (there, covariance) = fitted, learnt
    away = here - there
    beyond = max(float(away @ away - np.trace(own + covariance)) / 2, 0.0) * np.eye(2)
    wider = covariance + beyond if several else covariance
    gain = wider @ np.linalg.inv(wider + own + beyond)
    return there + gain @ away, wider - gain @ wider


def _at(detection: Detection, position: FloatArray, covariance: FloatArray) -> Detection:
    """The detection at another position (2,) m, with its covariance (2, 2) m²."""
    x, y = position.tolist()
    sd_x, sd_y = np.sqrt(np.diag(covariance)).tolist()
    cov_xy = float(covariance[0, 1])
    return replace(detection, x=x, y=y, sd_x=sd_x, sd_y=sd_y, cov_xy=cov_xy, bias=0.0)


def _pack(locator: Locator) -> Arrays:
    arrays: Arrays = {
        "dv": locator.presses.dv,
        "xy_m": locator.presses.xy,
        "outline_m": locator.region.outline,
        "pattern": np.array(locator.pattern_id),
        "skin": np.array(locator.skin_id),
    }
    presses = locator.presses
    optional = {"strength": presses.strength, "spread_m2": presses.spread}
    return {**arrays, **{key: v for key, v in optional.items() if v is not None}}


def _unpack(arrays: Arrays, pattern: Pattern, where: str, progress: Progress) -> Locator:
    strength, spread = (
        real_numbers(arrays, key, where) if key in arrays else None
        for key in ("strength", "spread_m2")
    )
    dv = real_numbers(arrays, "dv", where)
    if dv.shape[1:] != (pattern.n_meas,):
        raise DataError(f"expected {pattern.n_meas} rows of dv, got shape {dv.shape}", where=where)
    with located(where):
        presses = Presses.of(dv, real_numbers(arrays, "xy_m", where), strength, spread)
        region = Region.checked(real_numbers(arrays, "outline_m", where))
        skin_id = str(arrays.get("skin", ""))
        return Locator.learn(presses.within(region), region, pattern, skin_id, progress)


def _check(calibration: Calibration[Locator], skin: Skin) -> None:
    """It rests on measurements and positions alone: other settings of the image do not matter."""
    locator = calibration.model
    outline, known = Region.of(skin).outline, locator.region.outline
    same = outline.shape == known.shape and np.allclose(outline, known, atol=_SAME_SHAPE)
    if locator.skin_id and not same:
        raise calibration.mismatch("shape of the sheet", skin)


def _exclude(_locator: Locator, _measurements: IntArray) -> None:
    """The locator's features rest on all measurements."""


def _apply(locator: Locator, conditions: Conditions) -> Applied:
    return LocatedTouch(locator, _correction(locator, conditions))


def _correction(locator: Locator, conditions: Conditions) -> FitCorrection | None:
    """Of the fit, by some of the presses; None where none is fitted."""
    presses = locator.presses
    some = np.unique(np.linspace(0, len(presses) - 1, _TRIED).round().astype(int))
    fitted = conditions.fitted_presses(presses.dv[some])
    if fitted is None:
        return None
    positions, variances = np.full((len(some), 2), np.nan), np.full(len(some), np.nan)
    for k, found in enumerate(fitted):
        if found is not None:
            positions[k] = found.x, found.y
            variances[k] = (found.sd_x**2 + found.sd_y**2) / 2
    return FitCorrection.of(positions, variances, presses.xy[some])


def _excluded(nuisance: FloatArray) -> NDArray[np.bool_]:
    """(n_meas,) measurements of which the nuisance directions (n_meas, k), orthonormal, leave
    nothing."""
    return np.asarray((nuisance**2).sum(axis=1) > _ALL)


TOUCH = Kind(
    name="touch",
    title="tomoskin touch calibration",
    version=1,
    subject="touch",
    command="touch",
    attachment="calibration.npz",
    keys=frozenset({"dv", "xy_m", "outline_m"}),
    pack=_pack,
    unpack=_unpack,
    check=_check,
    exclude=_exclude,
    apply=_apply,
    skin_id=lambda locator: locator.skin_id,
    locates=True,
)
"""Touch positions from labelled presses; its model is a :class:`Locator`."""
