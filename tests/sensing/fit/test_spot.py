"""Spots on cells: exact voltages, derivatives, and no jumps as they move."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from sensing.fit.scene import sheet
from shapes import strip
from tomoskin.core import FloatArray, ModelError
from tomoskin.model.forward import ForwardModel
from tomoskin.model.mesh import Mesh
from tomoskin.model.pattern import Pattern
from tomoskin.sensing.fit import Response, Spots, spots_of
from tomoskin.sensing.fit.profile import PLAIN, USUAL, Profile
from tomoskin.sensing.fit.spot import depth_of


def test_content_is_what_the_cells_hold() -> None:
    response = sheet(16, 3000)
    spot = spots_of([[0.02, -0.03]], 0.02, -0.3)
    cells, change = response.spots.change(spot)
    assert response.spots.mesh.volumes[cells] @ change == pytest.approx(spot[0, 3], rel=5e-3)
    assert depth_of(spot)[0] == pytest.approx(-0.3)


def test_radius_is_that_of_an_even_disc_of_the_same_second_moment() -> None:
    response = sheet(16, 3000)
    cells, change = response.spots.change(spots_of([[0.0, 0.01]], 0.025, -0.3))
    mass = response.spots.mesh.volumes[cells] * change
    square = ((response.spots.mesh.centroids[cells] - [0.0, 0.01]) ** 2).sum(axis=1)
    assert np.sqrt(2 * mass @ square / mass.sum()) == pytest.approx(0.025, rel=0.01)


def test_changes_are_those_of_the_whole_model_solved_anew() -> None:
    response = sheet()
    spots = np.concatenate([spots_of([[0.04, 0.0]], 0.02, -0.5), spots_of([[0, 0.05]], 0.015, 0.4)])
    cells, change = response.spots.change(spots)
    sigma = response.state.conductivity.copy()
    sigma[cells] *= np.exp(change)
    expected = response.state.model.at(sigma).voltages - response.reference
    assert response.changes([spots])[0] == pytest.approx(expected, abs=1e-12)


def slopes_of(response: Response, spots: FloatArray) -> Iterator[FloatArray]:
    """By the first spot's parameters, from central differences of exact changes."""
    for number, step in enumerate([1e-5, 1e-5, 1e-4, 1e-8]):
        moved = np.zeros_like(spots)
        moved[0, number] = step
        ahead, behind = response.changes([spots + moved, spots - moved])
        yield (ahead - behind) / (2 * step)


@settings(max_examples=15)
@given(st.floats(-0.09, 0.09), st.floats(-0.09, 0.09), st.floats(0.012, 0.04), st.floats(-1.5, 1.0))
def test_derivatives_are_those_of_the_exact_change(
    x: float, y: float, radius: float, depth: float
) -> None:
    """By reciprocity, against central differences of local updates; with another spot beside."""
    response = sheet()
    spots = np.concatenate([spots_of([[x, y]], radius, depth), spots_of([[0.03, 0.0]], 0.02, -0.4)])
    change, jacobian, _ = response.expanded(spots)
    assert change == pytest.approx(response.changes([spots])[0], abs=1e-12)
    for number, slope in enumerate(slopes_of(response, spots)):
        size = max(np.abs(slope).max(), 1e-3 * np.abs(jacobian[:, 4 + number]).max())
        assert np.abs(jacobian[:, number] - slope).max() < 2e-4 * size


@pytest.mark.parametrize("layer", [0.003, 0.03])
def test_derivatives_on_a_layer(layer: float) -> None:
    response = Response(sheet().state, Profile.on(layer))
    spots = spots_of([[0.05, 0.02]], 0.02, -0.3)
    change, jacobian, _ = response.expanded(spots)
    assert change == pytest.approx(response.changes([spots])[0], abs=1e-12)
    for number, slope in enumerate(slopes_of(response, spots)):
        assert np.abs(jacobian[:, number] - slope).max() < 2e-4 * np.abs(slope).max()


def test_a_thicker_layer_carries_the_sheet_farther_round_a_steeper_dent() -> None:
    """Parts of the change 25 mm away, by noise-free presses of the twin; one in the middle."""
    away = 0.025 / USUAL
    thin, thick = (
        profile.at(np.array([0.0, (away / profile.reach) ** 2]))
        for profile in (Profile.on(0.003), Profile.on(0.03))
    )
    assert thin == pytest.approx([1.0, 0.2], abs=0.07)
    assert thick == pytest.approx([1.0, 0.3], abs=0.07)
    assert Profile.on(0.03).reach > 2.5 * Profile.on(0.003).reach
    assert Profile.on(None) is PLAIN


def test_a_direction_is_that_of_a_tensor_on_the_whole_model() -> None:
    """Against central differences of the sheet with a tensor in its cells."""
    response = sheet()
    spot = spots_of([[0.06, 0.02]], 0.025, -0.4)
    *_, nuisances = response.expanded(spot)
    cells, height = response.spots.change(spot)
    part = response.spots.part(spot[0])
    own, (xx, xy) = part.cells, part.directed
    sigma = response.state.conductivity.copy()
    sigma[cells] *= np.exp(height)
    found = []
    for step in (1e-3, -1e-3):
        tensor = sigma[:, None, None] * np.eye(2)
        turned = np.array([[xx, xy], [xy, -xx]]).transpose(2, 0, 1)
        tensor[own] += step * sigma[own, None, None] * turned
        found.append(response.state.model.at(tensor).voltages)
    slope = (found[0] - found[1]) / 2e-3
    assert nuisances[:, 0] == pytest.approx(slope, abs=1e-4 * np.abs(slope).max())


def test_another_shape_has_the_same_content_and_second_moment() -> None:
    response = sheet(16, 3000)
    spot, volumes = spots_of([[0.01, 0.0]], 0.025, -0.4), response.spots.mesh.volumes
    part = response.spots.part(spot[0])
    square = ((response.spots.mesh.centroids[part.cells] - spot[0, :2]) ** 2).sum(axis=1)
    content, moved = volumes[part.cells] * part.height, volumes[part.cells] * part.reshaped
    assert abs(moved.sum()) < 0.01 * abs(content.sum())
    assert abs(moved @ square) < 0.01 * abs(content @ square)
    assert np.abs(moved).sum() > 0.1 * np.abs(content).sum()


def test_a_shape_is_a_change_of_the_whole_model() -> None:
    response = sheet()
    spot = spots_of([[-0.03, 0.05]], 0.02, -0.4)
    cells, height = response.spots.change(spot)
    part = response.spots.part(spot[0])
    sigma = response.state.conductivity.copy()
    sigma[cells] *= np.exp(height)
    ends = []
    for step in (1e-3, -1e-3):
        changed = sigma.copy()
        changed[part.cells] *= np.exp(step * part.reshaped)
        ends.append(response.state.model.at(changed).voltages)
    slope = (ends[0] - ends[1]) / 2e-3
    assert response.expanded(spot)[2][:, 1] == pytest.approx(slope, abs=1e-4 * abs(slope).max())


def test_voltages_do_not_jump_between_cells() -> None:
    """Along a line over many cells the change's second difference stays small."""
    response = sheet()
    x = np.linspace(-0.05, 0.05, 401)
    spots = spots_of(np.column_stack([x, 0.013 + 0 * x]), 0.015, -0.3)
    found = response.changes([spot[None] for spot in spots])
    size = np.linalg.norm(found, axis=1).max()
    first, second = (np.linalg.norm(np.diff(found, n, axis=0), axis=1) for n in (1, 2))
    assert first.max() < 0.03 * size
    assert second.max() < 0.1 * first.max()


def test_a_spot_off_the_sheet_changes_nothing() -> None:
    response = sheet()
    assert not response.changes([spots_of([[0.5, 0.5]], 0.01, -0.3)]).any()


def test_only_flat_coordinates_and_a_scalar_conductivity() -> None:
    flat = strip(np.linspace(0, 0.1, 9), np.linspace(0, 0.1, 5))
    bent = Mesh(np.pad(flat.points, ((0, 0), (0, 1))), flat.cells, flat.electrodes)
    with pytest.raises(ModelError, match=r'flat coordinates.*method = "image"'):
        Spots(bent)
    model = ForwardModel(flat, Pattern.adjacent(4, include_driven=True), 1e-3)
    with pytest.raises(ModelError, match="real scalar conductivity"):
        Response(model.at(1.0 + 0.1j))
    with pytest.raises(ModelError, match="radii above 0"):
        spots_of([[0.0, 0.0]], 0.0, -0.3)
