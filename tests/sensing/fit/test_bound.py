"""The Cramér–Rao bound: against an independent figure, limits, and its own definition."""

from __future__ import annotations

import numpy as np
import pytest

from sensing.fit.scene import covariance, sheet, whitener
from tomoskin.core import ModelError
from tomoskin.model.forward import ForwardModel
from tomoskin.model.pattern import Scan
from tomoskin.model.skin import Skin
from tomoskin.sensing.fit import (
    Response,
    Whitener,
    position_bound,
    row_covariance,
    spots_of,
)
from tomoskin.sensing.fit.bound import fisher_information
from tomoskin.sensing.signal import Readout

ALONG = np.column_stack([np.linspace(0.0, 0.085, 8), np.zeros(8)])


@pytest.mark.parametrize(
    ("name", "least", "most"), [("textile-disc-8", 3.6, 5.6), ("textile-disc-16", 0.6, 3.7)]
)
def test_an_independent_model_has_figures_of_this_size(name: str, least: float, most: float):
    """Root mean square mm over 85 % of the radius: 0.1 A, 15 mm, 25 % deep, 16 detections, 0.7 LSB.
    The other model's profile and noise of the reference are not known: a factor of two."""
    skin = Skin.load(name).altered(
        {"readout": {"oversampling": 16, "gain": 40}, "mesh": {"cells": 1200}}
    )
    model = ForwardModel(skin.mesh(), skin.pattern(), skin.contact_impedance, skin.current)
    scan = Scan.of(skin.pattern())
    sample = Readout.of(scan, skin.readout).noise / np.sqrt(2)
    noise = Whitener.of(row_covariance(scan, sample))
    response = Response(model.at(skin.conductivity))
    spots = spots_of(ALONG, 0.015, -1.0)
    spots[:, 3] = np.pi * 0.015**2 * np.log(0.75)  # that of an even disc
    bound = position_bound(response, spots, noise)
    rms = 1e3 * np.sqrt(np.trace(bound, axis1=1, axis2=2))
    assert least / 2 < rms.min() < 2 * least
    assert most / 2 < rms[:-1].max() < 2 * most


def test_it_is_a_block_of_the_inverse_information() -> None:
    spots = spots_of(ALONG[::3], 0.02, -0.4)
    information = fisher_information(sheet(), spots, whitener())
    scale = 1 / np.sqrt(np.einsum("nii->ni", information))
    even = information * scale[:, :, None] * scale[:, None, :]
    inverse = np.linalg.inv(even) * scale[:, :, None] * scale[:, None, :]
    assert position_bound(sheet(), spots, whitener()) == pytest.approx(inverse[:, :2, :2], rel=1e-6)


def test_half_the_noise_is_a_quarter_of_the_covariance() -> None:
    spots = spots_of(ALONG[2:3], 0.02, -0.4)
    half = Whitener.of(covariance() / 4)
    whole = position_bound(sheet(), spots, whitener())
    assert position_bound(sheet(), spots, half) == pytest.approx(whole / 4, rel=1e-6)


def test_knowing_size_and_strength_can_only_help() -> None:
    spots = spots_of(ALONG, 0.02, -0.4)
    place = fisher_information(sheet(), spots, whitener())[:, :2, :2]
    gain = position_bound(sheet(), spots, whitener()) - np.linalg.inv(place)
    assert (np.linalg.eigvalsh(gain) > -1e-12).all()


def test_rows_that_share_a_sample_are_better_than_their_deviations_say() -> None:
    """Neighbouring differences have opposite errors; to forget that costs half the resolution."""
    spots = spots_of(ALONG[:1], 0.02, -0.4)
    alone = Whitener.of(np.sqrt(np.diag(covariance())))
    shared = position_bound(sheet(), spots, whitener())
    assert np.trace(position_bound(sheet(), spots, alone)[0]) > 2 * np.trace(shared[0])


def test_data_that_say_nothing_bound_nothing() -> None:
    outside = spots_of([[0.5, 0.5]], 0.02, -0.4)
    assert np.isinf(position_bound(sheet(), outside, whitener())).all()


def test_rows_that_follow_from_others_carry_no_news() -> None:
    rows = np.random.default_rng(0).standard_normal((3, 3))
    makes = np.vstack([rows, rows[0] - rows[1]])
    whiten = Whitener.of(makes @ makes.T)
    assert whiten.matrix.shape == (3, 4)
    whitened = whiten(makes.T).T
    assert whitened @ whitened.T == pytest.approx(np.eye(3), abs=1e-8)


@pytest.mark.parametrize("noise", [np.zeros(3), np.full(3, np.nan), np.ones((2, 2, 2))])
def test_noise_that_cannot_be_is_refused(noise: np.ndarray) -> None:
    with pytest.raises(ModelError, match="finite noise above 0"):
        Whitener.of(noise)
