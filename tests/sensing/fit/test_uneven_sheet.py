"""What a reference tells of an uneven sheet, and what that is worth to a press on it."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from sensing.fit.scene import covariance, noise
from sensing.fit.test_finder import NOTHING, model, place, skin, spread
from tomoskin.core import FloatArray, finished
from tomoskin.model.forward import ForwardModel, State
from tomoskin.model.mesh import triangulate
from tomoskin.sensing.fit import SpotFinder
from tomoskin.sensing.fit.uneven_sheet import channel_errors, field_modes, fitting_sheet

UNEVEN = 0.2
"""Height of the waves of log σ: a standard deviation of 14 %."""

FINGER, RADIUS, FALL = np.array([0.03, 0.045]), 0.016, 0.25


def waves(points: FloatArray) -> FloatArray:
    """Of some centimetres."""
    x, y = points.T
    return np.asarray(UNEVEN * np.sin(60 * x + 25 * y + 0.5) * np.cos(20 * x - 45 * y))


@cache
def uneven() -> State:
    """On a finer mesh of another seed, by a board that reads a tenth more."""
    ours = skin()
    mesh = triangulate(ours.outline, ours.arcs, 5000, seed=23)
    own = ForwardModel(mesh, ours.pattern(), ours.contact_impedance, 1.1 * ours.current)
    return own.at(ours.conductivity * np.exp(waves(mesh.centroids)))


def pressed() -> FloatArray:
    """(n_meas,) V by which an even round finger changes it."""
    state = uneven()
    under = np.linalg.norm(state.model.mesh.centroids - FINGER, axis=1) < RADIUS
    sigma = np.where(under, 1 - FALL, 1.0) * state.conductivity
    return np.asarray(state.model.at(sigma).voltages - state.voltages)


def test_an_uneven_sheet_is_seen_as_it_is() -> None:
    rest = model().response.state
    found = finished(fitting_sheet(rest, uneven().voltages, 5e-6))
    true = waves(rest.model.mesh.centroids)
    seen = np.log(found.conductivity / rest.conductivity)
    left = (seen - seen.mean()) - (true - true.mean())
    assert left.std() < 0.25 * true.std()
    ratio = found.voltages / uneven().voltages
    assert np.abs(ratio / np.median(ratio) - 1).max() < 0.05


def test_an_even_sheet_stays_as_it_is() -> None:
    ours, rest = skin(), model().response.state
    mesh = triangulate(ours.outline, ours.arcs, 5000, seed=23)
    even = ForwardModel(mesh, ours.pattern(), ours.contact_impedance, ours.current)
    assert finished(fitting_sheet(rest, even.solve(ours.conductivity).voltages, 5e-6)) is rest


def test_contacts_and_channels_are_no_unevenness() -> None:
    """Wrong contacts, gains and offsets of the size that boards have."""
    rest, random = model().response.state, np.random.default_rng(3)
    errors = channel_errors(rest)
    reference = rest.voltages + errors @ random.standard_normal(errors.shape[1])
    found = finished(fitting_sheet(rest, reference, 5e-6))
    assert np.log(found.conductivity / rest.conductivity).std() < 0.01


def test_rows_without_a_value_do_not_count_and_too_few_tell_nothing() -> None:
    rest, reference = model().response.state, uneven().voltages.copy()
    reference[::5] = np.nan
    true = waves(rest.model.mesh.centroids)
    seen = np.log(finished(fitting_sheet(rest, reference, 5e-6)).conductivity)
    assert np.corrcoef(seen, true)[0, 1] > 0.95
    reference[20:] = np.nan
    assert finished(fitting_sheet(rest, reference, 5e-6)) is rest


def test_a_reference_of_another_skin_leaves_the_sheet_as_it_is() -> None:
    """No sheet comes near it, whatever its noise, and nothing fails."""
    rest = model().response.state
    signs = (-1.0) ** np.arange(len(rest.voltages))
    for reference in (rest.voltages * signs, np.roll(rest.voltages, 1) * signs):
        for deviation in (0.0, 5e-6):
            assert finished(fitting_sheet(rest, reference, deviation)) is rest


def test_a_press_on_an_uneven_sheet_is_nearer_to_where_it_is() -> None:
    state, plain = uneven(), model()
    fitted = finished(plain.fitting(state.voltages, 5e-6))
    clean, errors = pressed(), []
    for spots in (plain, fitted):
        modelled = spots.response.reference
        gain = float(state.voltages @ modelled / (modelled @ modelled))
        finder = SpotFinder(spots, skin(), skin().mesh(), covariance(), gain)
        found = [finder.push(clean + n, NOTHING)[0] for n in noise(16, 6, 2)]
        errors.append(np.linalg.norm([place(d) - FINGER for d in found], axis=1).mean())
    assert errors[1] < 0.6 * errors[0]
    away = place(found[-1]) - FINGER
    assert away @ np.linalg.solve(spread(found[-1]), away) < 9


def test_modes_are_those_of_the_field() -> None:
    """Their products are the correlation, and their number does not grow with the mesh."""
    mesh = skin().mesh()
    modes = field_modes(mesh, 0.04)
    some = np.arange(0, len(mesh.cells), 97)
    apart = np.linalg.norm(mesh.centroids[some, None] - mesh.centroids[some], axis=2)
    expected = np.exp(-(apart**2) / (2 * 0.04**2))
    assert modes[some] @ modes[some].T == pytest.approx(expected, abs=0.02)
    assert modes.shape[1] <= 60


def test_a_contact_moves_rows_as_the_model_says() -> None:
    rest = model().response.state
    own = rest.model
    impedance = own.contact_impedance * np.ones(16)
    impedance[5] *= np.exp(0.03)
    changed = ForwardModel(own.mesh, own.pattern, impedance, own.current).at(rest.conductivity)
    slope = (changed.voltages - rest.voltages) / 0.1
    assert channel_errors(rest)[:, 5] == pytest.approx(slope, abs=0.03 * np.abs(slope).max())
