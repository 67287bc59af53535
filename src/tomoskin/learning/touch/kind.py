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

_SAME_SHAPE = 1e-4
"""Outlines within so many metres of each other are one."""


class LocatedTouch(Applied):
    """The image tells that there is a touch, labelled presses where: of one touch at a time.

    Measurements that have jumped since the presses are left out where frames do not fit with them.
    """

    def __init__(self, locator: Locator) -> None:
        self._watch = Watch(locator, LIVE)
        self._standing = Standing()
        self._stood = 0

    def locate(self, view: FrameView, detections: list[Detection]) -> list[Detection]:
        """The strongest detection, at the position that the presses tell."""
        if not detections:
            self._standing.clear()
            self._stood = 0
            return []
        # The presses were learnt with all that is in them: nothing is taken out here either.
        differences = view.differences
        dv = np.where(_excluded(differences.nuisance), np.nan, differences.change)
        if not np.isfinite(dv).any():
            return []
        (position,), (covariance,) = self._watch(self._standing.push(dv), settled=self._settled())
        sd_x, sd_y = np.sqrt(np.diag(covariance)).tolist()
        return [
            replace(
                detections[0],
                x=float(position[0]),
                y=float(position[1]),
                sd_x=sd_x,
                sd_y=sd_y,
                cov_xy=float(covariance[0, 1]),
                bias=0.0,
            )
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
        return self._watch.health


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


def _apply(locator: Locator, _conditions: Conditions) -> Applied:
    return LocatedTouch(locator)


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
