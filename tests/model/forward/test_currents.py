"""Drives that are currents into many electrodes: sums of what pairs do, and a box driven so."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest

from shapes import disc
from tomoskin.core import FloatArray, IntArray, ModelError, PatternError
from tomoskin.imaging import OneStep
from tomoskin.model.forward import ForwardModel
from tomoskin.model.mesh import Mesh
from tomoskin.model.pattern import Pattern, Scan

RNG = np.random.default_rng(9)
N = 8
RING = np.column_stack([np.arange(N), (np.arange(N) + 1) % N])
CURRENTS = RNG.standard_normal((5, N))
CURRENTS -= CURRENTS.mean(axis=1, keepdims=True)
SPREAD = Pattern.from_pairs(N, CURRENTS, RING, include_driven=True)
PAIRS = Pattern.from_pairs(N, np.column_stack([np.arange(N - 1), np.full(N - 1, N - 1)]), RING,
                           include_driven=True)  # fmt: skip
MESH = disc(N, 300, width=0.015)


def summed(of_pairs: FloatArray) -> FloatArray:
    """(n_meas, …) of each electrode against the last → of the currents."""
    parts = of_pairs.reshape(N - 1, N, *of_pairs.shape[1:])
    return np.tensordot(CURRENTS[:, :-1], parts, 1).reshape(-1, *of_pairs.shape[1:])


@pytest.mark.parametrize("kind", ["real", "complex", "tensor"])
def test_a_drive_is_the_sum_of_pairs(kind: str) -> None:
    z = 0.01 + 0.002j if kind == "complex" else 0.01
    sigma = RNG.uniform(0.5, 2.0, len(MESH.cells))
    if kind == "tensor":
        sigma = sigma[:, None, None] * np.array([[1.2, 0.1], [0.1, 0.8]])
    current = RNG.uniform(0.5, 2.0, len(CURRENTS))
    states = [ForwardModel(MESH, p, z, i).at(sigma) for p, i in ((PAIRS, 1.0), (SPREAD, current))]
    by_pair, by_current = states
    scale = np.repeat(current, N)
    assert by_current.voltages == pytest.approx(scale * summed(by_pair.voltages), rel=1e-9)
    expected = scale.reshape(-1, *[1] * (by_pair.jacobian.ndim - 1)) * summed(by_pair.jacobian)
    assert by_current.jacobian == pytest.approx(expected, rel=1e-9, abs=1e-12)
    expected = scale[:, None] * summed(by_pair.contact_jacobian)
    assert by_current.contact_jacobian == pytest.approx(expected, rel=1e-9, abs=1e-12)
    potentials = current[:, None] * CURRENTS @ by_pair.transfer_resistance
    assert by_current.electrode_potentials == pytest.approx(potentials, rel=1e-9)
    if kind == "real":  # the power of a drive is turned to heat in cells and contacts
        heat = np.einsum("ke,ke->k", current[:, None] * CURRENTS, potentials)
        assert (by_current.power.sum(axis=1) < heat).all()
        assert (by_current.power.sum(axis=1) > 0.1 * heat).all()
    if kind != "tensor":
        change, weights = RNG.standard_normal((2, len(sigma))), RNG.standard_normal(len(scale))
        assert by_current.jvp(change) == pytest.approx(change @ by_current.jacobian.T, rel=1e-9)
        assert by_current.vjp(weights) == pytest.approx(weights @ by_current.jacobian, rel=1e-9)


def test_rows_and_names_of_such_a_pattern() -> None:
    again = Pattern.from_tables(SPREAD.drive, SPREAD.measure)
    assert again.identity == SPREAD.identity != PAIRS.identity
    assert Pattern.from_tables(SPREAD.drive[:N], SPREAD.measure[:N]).n_drive == 1
    assert SPREAD.row_text(9) == "row 9: drive 1, plus E2, minus E3"
    few = Pattern.from_pairs(N, [[1.0, -0.5, -0.5, 0, 0, 0, 0, 0]], RING)
    assert few.measure.tolist() == [[3, 4], [4, 5], [5, 6], [6, 7]]
    assert few.rows_of(1).tolist() == [0, 1, 2, 3]
    assert few.rows_of(3).tolist() == [0]


def test_what_cannot_be_driven_is_named() -> None:
    leaking = CURRENTS.copy()
    leaking[0] += 0.1
    with pytest.raises(PatternError, match=r"sum to zero, got a sum of 0\.8") as caught:
        Pattern.from_pairs(N, leaking, RING, include_driven=True)
    assert caught.value.where == "drive row 0"
    with pytest.raises(PatternError, match="not all zero"):
        Pattern.from_pairs(N, 0.0 * CURRENTS, RING, include_driven=True)
    with pytest.raises(
        PatternError, match=r"currents \(rows, 9\) into every electrode, got \(40, 8\)"
    ):
        Pattern.from_tables(SPREAD.drive, SPREAD.measure, 9)
    with pytest.raises(PatternError, match="include_driven=True"):
        Pattern.from_pairs(N, CURRENTS, RING)
    with pytest.raises(PatternError, match="rows 0 and 40 measure the same pair"):
        Pattern.from_tables(np.vstack([SPREAD.drive, SPREAD.drive[:1]]), [*SPREAD.measure, [1, 0]])
    with pytest.raises(PatternError, match="cannot be joined"):
        SPREAD.joined(PAIRS)
    with pytest.raises(PatternError, match="a pair at a time"):
        Scan.of(SPREAD)
    with pytest.raises(ModelError, match="the pattern 8"):
        ForwardModel(disc(4, 300, width=0.015), SPREAD, 0.01)


def brick_box(centres: FloatArray, size: FloatArray, half: float) -> Mesh:
    """A box of tetrahedra with square plates around ``centres`` on its sides, m."""
    lines = [_lines(centres, size, half, axis) for axis in range(3)]
    counts = [len(line) for line in lines]
    points = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 3)
    number = np.arange(len(points)).reshape(counts)
    corner = number[:-1, :-1, :-1].reshape(-1, 1)
    step = np.array([counts[1] * counts[2], counts[2], 1])
    ways = [(0, 1, 2), (1, 2, 0), (2, 0, 1), (0, 2, 1), (2, 1, 0), (1, 0, 2)]
    paths = np.array([np.cumsum([0, *step[list(way)]]) for way in ways])
    cells = (corner[:, None] + paths).reshape(-1, 4)
    faces = np.sort(np.concatenate([np.delete(cells, i, axis=1) for i in range(4)]), axis=1)
    faces, count = np.unique(faces, axis=0, return_counts=True)
    rim: IntArray = faces[count == 1]
    near = np.abs(points[rim].mean(axis=1)[:, None] - centres)
    flat = np.abs(np.abs(centres) - size / 2) < 1e-9
    inside = np.where(flat, near < 1e-9, near < half).all(axis=2)
    return Mesh(points, cells, tuple(rim[own] for own in inside.T))


def _lines(centres: FloatArray, size: FloatArray, half: float, axis: int) -> FloatArray:
    ends = np.concatenate([centres[:, axis] - half, centres[:, axis] + half])
    ends = ends[np.abs(ends) < size[axis] / 2]
    stops = np.unique(np.round([-size[axis] / 2, *ends, size[axis] / 2], 6))
    parts = [
        np.linspace(low, high, 1 + max(1, round((high - low) / 0.022)))[:-1]
        for low, high in itertools.pairwise(stops)
    ]
    return np.concatenate([*parts, stops[-1:]])


@pytest.mark.data
@pytest.mark.parametrize("kind", ["opt", "trig"])
@pytest.mark.parametrize("targets", [1, 2])
def test_spheres_in_a_box_that_is_driven_on_all_plates(
    data_dir: Path, kind: str, targets: int
) -> None:
    """ACT5: the middle of each greatest change, above its half, is within 0.5 cm of a sphere."""
    with np.load(data_dir / "rigs_of_others" / "act5_box32.npz") as act5:
        centres, size = act5["plate_centre_cm"] / 100, act5["box_cm"] / 100
        currents = act5[f"saline_{kind}_current"].T
        ring = np.column_stack([np.arange(32), (np.arange(32) + 1) % 32])
        potentials = [act5[f"{name}_{kind}_voltage"].T for name in ("saline", f"{targets}targ")]
        spheres = [act5[f"target_{number}_cm"] / 100 for number in (1, 2)[:targets]]
    centres[np.abs(centres) == 0.045] *= 0.0425 / 0.045  # else plates overlap the box's edge
    pattern = Pattern.from_pairs(32, currents, ring, include_driven=True)
    plus, minus = pattern.measure.T
    water, changed = (v[pattern.drive_index, plus] - v[pattern.drive_index, minus]
                      for v in potentials)  # fmt: skip
    model = ForwardModel(brick_box(centres, size, 0.04), pattern, contact_impedance=1e-3)
    unit = model.solve(1.0).voltages
    conductivity = (unit @ unit) / (water @ unit)
    assert water @ unit > 0.99 * np.linalg.norm(water) * np.linalg.norm(unit)
    image = OneStep(model, "noser", alpha=0.1, conductivity=conductivity)(changed - water).values
    mesh, missed = model.mesh, list(spheres)
    for _ in spheres:
        peak = np.linalg.norm(mesh.centroids - mesh.centroids[image.argmax()], axis=1) < 0.04
        weight = np.where(peak & (image > 0.5 * image.max()), image, 0.0) * mesh.volumes
        error = [np.linalg.norm(weight @ mesh.centroids / weight.sum() - s) for s in missed]
        assert min(error) < 0.005
        del missed[int(np.argmin(error))]
        image = np.where(peak, -np.inf, image)
