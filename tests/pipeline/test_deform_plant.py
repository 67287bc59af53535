"""The plant of ``bench deform``: its sheet, its strains and its laws against what is known."""

from __future__ import annotations

import importlib
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tomoskin import Skin
from tomoskin.model.forward import ForwardModel
from tomoskin.model.mesh import Hinge, Plane
from tomoskin.twin import Bent

BENCHMARKS = Path(__file__).resolve().parents[2] / "benchmarks"


@pytest.fixture
def plant(monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    module = importlib.import_module("deform_plant")
    monkeypatch.setattr(module, "UNEVEN", (0.0, 0.0))
    monkeypatch.setattr(module, "CONTACTS", 0.0)
    return module


@pytest.fixture
def even(plant: Any) -> Any:
    return plant.Sheet(Skin.load("textile-disc-16"), 1)


def resistance(sheet: Any, law: Any, strain: np.ndarray, **where: Any) -> np.ndarray:
    tensor = sheet.conductance(law, np.broadcast_to(strain, (*sheet.inner.shape[:2], 2, 2)), 1.0)
    found = sheet.resistance(tensor, **where)
    return found - found.mean(axis=0)


def test_a_sheet_at_rest_reads_as_the_model_of_the_skin(plant: Any, even: Any) -> None:
    skin = Skin.load("textile-disc-16")
    model = ForwardModel(skin.mesh(), skin.pattern(), skin.contact_impedance, skin.current)
    known = model.at(np.full(len(skin.mesh().cells), skin.conductivity)).transfer_resistance
    volts = model.voltages(resistance(even, plant.Affine(), np.zeros((2, 2))))
    np.testing.assert_allclose(volts, model.voltages(known), rtol=0.01)


def test_electrodes_turn_with_the_rim(plant: Any, even: Any) -> None:
    still = resistance(even, plant.Affine(), np.zeros((2, 2)))
    step = -2 * math.pi / 16
    turned = resistance(even, plant.Affine(), np.zeros((2, 2)), turned=step)
    np.testing.assert_allclose(turned, still, atol=0.01 * np.abs(still).max())
    np.testing.assert_allclose(
        resistance(even, plant.Affine(), np.zeros((2, 2)), turned=16 * step), still, rtol=1e-9
    )


def test_a_stretched_tensor_is_a_stretched_mesh(plant: Any, even: Any) -> None:
    """Constant sheet conductance: the tensor at rest and the moved nodes are one problem."""
    pose = plant.Stretch(0.04, -0.015, 0.7)
    strain = pose.strain(even.points[:1])[0]
    law = plant.Percolating(0.0, 1.0)
    by_tensor = even.conductance(law, np.broadcast_to(strain, (*even.inner.shape[:2], 2, 2)), 1.0)
    longer = np.eye(2) + strain
    inverse = np.linalg.inv(longer)
    pulled = even.sigma[0] * np.linalg.det(longer) * inverse @ inverse.T
    np.testing.assert_allclose(by_tensor, np.broadcast_to(pulled, by_tensor.shape), rtol=1e-12)


@pytest.mark.parametrize("profile", ["hinge", "cosine", "bell", "lopsided"])
def test_a_fold_turns_by_its_angle_about_its_line(plant: Any, profile: str) -> None:
    fold = plant.Fold(math.radians(30), 0.4, 0.02, 0.05, profile)
    right = np.array([math.sin(0.4), -math.cos(0.4)])
    s = np.linspace(-0.2, 0.2, 20001)
    strain = fold.strain(s[:, None] * right)
    across = np.einsum("nij,i,j->n", strain, right, right)
    np.testing.assert_allclose(np.trapezoid(across, s) / plant.HEIGHT, math.radians(30), rtol=1e-3)
    np.testing.assert_allclose(
        np.trapezoid(across * s, s) / np.trapezoid(across, s), 0.02, atol=1e-4
    )
    np.testing.assert_allclose(np.trace(strain, axis1=1, axis2=2), across, atol=1e-12)


def test_laws_have_the_gauges_of_their_strain(plant: Any) -> None:
    """Affine: 2 along and none beside; percolating: steeper, and steeper still further on."""
    small = 1e-6

    def gauge(law: Any, longer: float, beside: float) -> float:
        return float(-np.log(law(np.array(longer), np.array(beside))) / small)

    assert gauge(plant.Affine(), small, 0.0) == pytest.approx(2, rel=1e-4)
    assert gauge(plant.Affine(), 0.0, small) == pytest.approx(0, abs=1e-4)
    law = plant.Percolating(4.0, 0.75)
    assert gauge(law, small, 0.0) == pytest.approx(1 + 1.3 * 3.0, rel=1e-4)
    assert gauge(law, 0.0, small) == pytest.approx(-1 + 1.3 * 1.0, rel=1e-4)
    assert -np.log(law(np.array(0.05), np.array(0.0))) > 1.05 * 0.05 * 4.9


def test_a_fold_lies_where_a_hinge_of_these_numbers_does(plant: Any) -> None:
    hinge = Hinge(math.radians(20), 0.05, axis=0.4, at=0.03)
    points = np.random.default_rng(1).uniform(-0.06, 0.06, (200, 2))
    xx, yy, xy = Bent(hinge).strain(points, Plane(), plant.HEIGHT).T
    known = np.stack([[xx, xy], [xy, yy]]).transpose(2, 0, 1)
    fold = plant.Fold(math.radians(20), 0.4, 0.03, 0.05)
    np.testing.assert_allclose(fold.strain(points), known, atol=5e-4)
    assert 20 < np.count_nonzero(known[:, 0, 0] > 1e-4) < 180


def test_what_slides_is_what_the_strain_adds_up_to(plant: Any) -> None:
    fold = plant.Fold(0.5, 0.4, 0.02, 0.05, "bell")
    right, step = np.array([math.sin(0.4), -math.cos(0.4)]), 1e-3
    at = np.linspace(-0.05, 0.08, 14)[:, None] * right
    slope = (fold.shift(at + step * right) - fold.shift(at - step * right)) @ right / 2 / step
    across = np.einsum("nij,i,j->n", fold.strain(at), right, right)
    np.testing.assert_allclose(slope, across, atol=0.02 * np.abs(across).max())
    np.testing.assert_allclose(fold.shift(0.02 * right[None]), 0.0, atol=2e-5)
