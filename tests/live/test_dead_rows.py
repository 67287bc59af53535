"""A recording without some rows gives the picture of an operator without them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from golden import mismatch
from tomoskin.core import DataError
from tomoskin.live import prepare, reconstruct
from tomoskin.pattern import Pattern
from tomoskin.session import Recording
from tomoskin.skin import Skin

SKINS = {
    kind: Skin.load("textile-disc-8").altered({"inverse": {"alpha": 0.1, "difference": kind}})
    for kind in ("plain", "normalised")
}
ROWS = [3, 17, 30]


def recording(pattern: Pattern, voltages: np.ndarray, *, is_change: bool = False) -> Recording:
    return Recording(
        voltages=voltages,
        drive=pattern.drive,
        measure=pattern.measure,
        time=np.arange(len(voltages)) / 10,
        reference=None,
        labels=None,
        is_change=is_change,
        source="a recording",
    )


@pytest.mark.parametrize("kind", SKINS)
@pytest.mark.parametrize("scale", [1.0, 1.3])
def test_images_are_those_without_the_rows(kind: str, scale: float) -> None:
    prepared = prepare(SKINS[kind])
    model = prepared.operator.reference
    change = 1e-3 * np.random.default_rng(0).standard_normal((4, 40)) * np.abs(model)
    voltages = scale * (model + change)
    voltages[:, ROWS] = np.nan
    idle = np.tile(scale * model, (3, 1))
    found = reconstruct(prepared, recording(prepared.pattern, voltages), idle)
    assert found.rows_left_out.tolist() == ROWS
    assert len(found.frames) == 4
    dv = scale * change if kind == "plain" else change / np.abs(model)
    expected = prepared.operator.without(ROWS)
    for image, data in zip(found.images, dv, strict=True):
        assert mismatch(image, expected(data).values) < 1e-4  # in single precision


def test_differences_without_the_rows() -> None:
    prepared = prepare(SKINS["plain"])
    dv = np.random.default_rng(0).standard_normal((3, 40))
    broken = dv.copy()
    broken[:, ROWS] = np.inf
    given = recording(prepared.pattern, broken, is_change=True)
    found = reconstruct(prepared, given, None)
    assert mismatch(found.images[0], prepared.operator.without(ROWS)(dv[0]).values) < 1e-4
    assert np.isinf(given.voltages[:, ROWS]).all()  # what was given stays as it was


def test_rows_that_only_the_idle_frames_lack() -> None:
    prepared = prepare(SKINS["plain"])
    voltages = np.tile(prepared.operator.reference, (3, 1))
    idle = voltages.copy()
    idle[:, ROWS] = np.nan
    found = reconstruct(prepared, recording(prepared.pattern, voltages), idle)
    assert found.rows_left_out.tolist() == ROWS
    assert np.abs(found.images).max() < 1e-9


def test_rows_in_another_order_are_refused_by_identity() -> None:
    prepared = prepare(SKINS["plain"])
    voltages = np.tile(prepared.operator.reference, (3, 1))
    given = recording(prepared.pattern, voltages)
    order = np.roll(np.arange(40), 1)
    other = replace(given, drive=given.drive[order], measure=given.measure[order])
    with pytest.raises(DataError, match=f"expected data of pattern {prepared.pattern.identity}"):
        reconstruct(prepared, other, voltages)
