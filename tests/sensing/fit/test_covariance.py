"""The covariance that is learnt from few idle frames, beside the true one."""

from __future__ import annotations

import numpy as np
import pytest

from tomoskin.core import finished
from tomoskin.model.pattern import Pattern, Scan
from tomoskin.sensing.fit import Whitener, idle_covariance, row_covariance
from tomoskin.sensing.fit.noise_structure import drawn_together
from tomoskin.sensing.signal import Scatter

SCAN = Scan.of(Pattern.adjacent(8))
N = len(SCAN.plus)
SHARED = row_covariance(SCAN, 1.0) / 2
FRAMES = 30


def hum(size, seed=0):
    """(n_meas, n_meas) of two waves that all rows have in common."""
    waves = np.random.default_rng(seed).standard_normal((N, 2))
    return size**2 * waves @ waves.T


def loud(electrode, times):
    """One electrode's samples waver more."""
    return row_covariance(SCAN, np.where(SCAN.sample_electrode == electrode, times, 1.0)) / 2


CASES = {
    "shared": SHARED,
    "independent": np.eye(N),
    "half": (SHARED + np.eye(N)) / 2,
    "hum": SHARED + hum(3.0),
    "loud electrode": loud(3, 10.0),
    "loud row": np.diag(np.where(np.arange(N) == 5, 100.0, 1.0)),
}


def idle(truth, seed, frames=FRAMES):
    noise = np.random.default_rng(seed).standard_normal((frames, N))
    return noise @ np.linalg.cholesky(truth + 1e-9 * np.eye(N)).T


def learnt(values, signatures=None):
    scatter = Scatter.of(values)
    return finished(
        idle_covariance(SCAN, scatter, least=0.0, step=1e-6, oversampling=1, signatures=signatures)
    )


def judged(covariance, truth, signatures):
    """True deviation of what counts one, and part of the true distance that is left."""
    white, known = Whitener.of(covariance), Whitener.of(truth)
    matched = white(signatures)
    size = np.linalg.norm(matched, axis=1)
    weights = matched / size[:, None] @ white.matrix
    deviation = np.sqrt(np.einsum("ni,ij,nj->n", weights, truth, weights))
    return deviation, size / np.linalg.norm(known(signatures), axis=1)


@pytest.mark.parametrize("name", CASES)
def test_what_is_learnt_from_30_frames_is_nearly_the_truth(name):
    truth = CASES[name]
    signatures = np.random.default_rng(1).standard_normal((200, N))
    found = [judged(learnt(idle(truth, seed)), truth, signatures) for seed in range(6)]
    deviation, kept = (np.array(each) for each in zip(*found, strict=True))
    assert deviation.max() < 1.4
    assert 0.8 < deviation.mean() < 1.05
    assert 0.85 < kept.mean() < 1.1


def test_the_read_outs_structure_alone_is_no_model_of_independent_rows():
    """What was believed before: the test above fails with it."""
    signatures = np.random.default_rng(1).standard_normal((200, N))
    deviation, _ = judged(SHARED, np.eye(N), signatures)
    assert deviation.min() > 1.5


def test_more_frames_are_nearer():
    truth = CASES["hum"]
    signatures = np.random.default_rng(1).standard_normal((200, N))
    few, many = (
        judged(learnt(idle(truth, 3, frames)), truth, signatures)[1].min() for frames in (30, 480)
    )
    assert few < many
    assert many > 0.95


def test_a_touch_among_the_idle_frames_is_not_learnt():
    signature = np.random.default_rng(4).standard_normal((1, N))
    values = idle(SHARED, 5)
    values[20:] += 8 * signature
    deaf, hears = learnt(values), learnt(values, signature)
    size = [np.linalg.norm(Whitener.of(c)(signature)) for c in (deaf, hears, SHARED)]
    assert size[0] < 0.5 * size[2]
    assert size[1] > 0.7 * size[2]


def test_no_noise_at_all_leaves_rounding():
    silent = Scatter.of(np.zeros((20, N)))
    covariance = finished(idle_covariance(SCAN, silent, least=0.1, step=1.0, oversampling=8))
    assert (np.diag(covariance) > 0.01).all()


def test_variances_are_drawn_together_as_far_as_chance_explains_them():
    random = np.random.default_rng(6)
    same = random.chisquare(29, 400) / 29
    drawn, free = drawn_together(same, 29)
    assert drawn.std() < 0.35 * same.std()
    assert free < 40
    spread = np.exp(random.normal(0, 2, 400))
    kept, _ = drawn_together(same * spread, 29)
    assert np.log(kept / spread).std() < 0.3


def test_a_row_that_stands_out_is_not_drawn_in():
    variance = np.ones(40) + np.linspace(-0.05, 0.05, 40)
    variance[7] = 100.0
    assert drawn_together(variance, 29)[0][7] > 60
