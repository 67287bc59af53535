"""The kind of calibration that tells the force of touches, from presses with known weights.

Keys of the .npz: ``kind``, ``version``; of n touches in the order of time ``xy_m`` (n, 2),
``area_m2``, ``peak_s``, ``snr``, ``force_n`` (NaN where not known), ``press``, ``time_s`` (n,);
``conductivity_s``, ``unit_m``; ``method``; ``drive``, ``measure`` (n_meas, 2), ``n_electrodes``;
``skin`` identity, ``skin_name``. What was learnt is learnt again when the file is read.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tomoskin.core import Arrays, DataError, Detection, FloatArray, IntArray, real_numbers
from tomoskin.learning.force.model import ForceModel, PressedSpots
from tomoskin.learning.force.presses import WeighedPresses
from tomoskin.learning.kind import (
    Applied,
    Calibration,
    Conditions,
    FrameView,
    Kind,
    Progress,
    located,
)
from tomoskin.model.pattern import Pattern
from tomoskin.model.skin import Skin

_COLUMNS = ("area_m2", "peak_s", "snr", "force_n", "press", "time_s")


class ForceApplied(Applied):
    """Gives each touch its force; what the pressed spots remember goes from frame to frame."""

    def __init__(self, model: ForceModel) -> None:
        self._model = model
        self._spots: PressedSpots | None = None

    def locate(self, view: FrameView, detections: list[Detection]) -> list[Detection]:
        """The same detections, with forces."""
        forces, self._spots = self._model.read(self._spots, detections, view.time)
        return [
            replace(detection, force=force)
            for detection, force in zip(detections, forces, strict=True)
        ]


def _pack(model: ForceModel) -> Arrays:
    p = model.presses
    columns = (p.area, p.peak, p.snr, p.force, p.press, p.time)
    return {
        "xy_m": p.xy,
        **dict(zip(_COLUMNS, columns, strict=True)),
        "conductivity_s": np.array(model.conductivity),
        "unit_m": np.array(model.unit),
        "method": np.array(model.method),
        "skin": np.array(model.skin_id),
    }


def _unpack(arrays: Arrays, _pattern: Pattern, where: str, _progress: Progress) -> ForceModel:
    xy, *columns = (real_numbers(arrays, key, where) for key in ("xy_m", *_COLUMNS))
    if xy.shape[1:] != (2,) or any(column.shape != xy.shape[:1] for column in columns):
        raise DataError(
            f"expected xy_m and {', '.join(_COLUMNS)} of each touch, got shapes "
            f"{', '.join(str(column.shape) for column in (xy, *columns))}",
            where=where,
        )
    conductivity, unit = (real_numbers(arrays, key, where) for key in ("conductivity_s", "unit_m"))
    if conductivity.shape or unit.shape or not (conductivity > 0 and unit > 0):
        raise DataError(
            f"expected a conductivity and a unit above 0, got {conductivity} and {unit}",
            where=where,
        )
    area, peak, snr, force, press, time = columns
    with located(where):
        _check_touches(xy, area, peak)
        detections = [_detection(*row) for row in np.column_stack([xy, area, peak, snr]).tolist()]
        presses = WeighedPresses.of(detections, force, press, time)
        return ForceModel.learn(
            presses,
            float(conductivity),
            float(unit),
            str(arrays.get("skin", "")),
            str(arrays.get("method", "fit")),
        )


def _check_touches(*columns: FloatArray) -> None:
    if not all(np.isfinite(column).all() for column in columns):
        raise DataError("expected finite xy_m, area_m2 and peak_s of every touch, got others")


def _detection(x: float, y: float, area: float, peak: float, snr: float) -> Detection:
    nothing = np.empty(0, dtype=np.int64)
    return Detection(x, y, np.nan, np.nan, area, peak, nothing, snr=snr)


def _check(calibration: Calibration[ForceModel], skin: Skin) -> None:
    """Forces rest on the sheet and on how touches are found on it, not on its images."""
    model = calibration.model
    if skin.touch.method != model.method:
        raise DataError(
            f'the calibration of forces needs touches found by method "{model.method}", but this '
            f'skin\'s method is "{skin.touch.method}"',
            where="[touch] method",
            hint=f'set method = "{model.method}" in the skin file, or calibrate again: '
            "tomoskin calibrate force",
        )
    if not np.isclose(skin.conductivity, model.conductivity, rtol=1e-6):
        raise calibration.mismatch("sheet", skin)


def _exclude(model: ForceModel, _measurements: IntArray) -> ForceModel:
    """Touches found without some measurements are touches all the same."""
    return model


def _apply(model: ForceModel, conditions: Conditions) -> Applied:
    """Regions of an image have other peaks and areas than fitted touches: they get no force."""
    is_like = conditions.fitted == (model.method == "fit")
    return ForceApplied(model) if is_like else Applied()


FORCE = Kind(
    name="force",
    title="tomoskin force calibration",
    version=1,
    subject="forces",
    command="force",
    attachment="force.npz",
    keys=frozenset({"xy_m", *_COLUMNS, "conductivity_s", "unit_m", "method"}),
    pack=_pack,
    unpack=_unpack,
    check=_check,
    exclude=_exclude,
    apply=_apply,
    skin_id=lambda model: model.skin_id,
)
"""Forces of touches from known weights; its model is a :class:`ForceModel`."""
