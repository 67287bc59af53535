"""Leaving rows out is the same as an operator that never had them."""

import numpy as np

from tomoskin.live.missing import fill


def test_picture_is_that_of_the_reduced_operator():
    rng = np.random.default_rng(1)
    jacobian = rng.normal(size=(12, 30))
    weights = rng.uniform(0.5, 2, 12)
    prior = np.diag(rng.uniform(1, 3, 30))
    missing = np.zeros(12, bool)
    missing[[2, 7, 8]] = True

    def operator(j, w):
        return np.linalg.solve(j.T @ (w[:, None] * j) + 0.3 * prior, j.T * w)

    whole = operator(jacobian, weights)
    reduced = operator(jacobian[~missing], weights[~missing])
    dv = rng.normal(size=12)
    expected = reduced @ dv[~missing]

    dv[missing] = np.nan
    picture = whole @ fill(dv, missing, jacobian @ whole)
    np.testing.assert_allclose(picture, expected, rtol=1e-9)


def test_nothing_missing_changes_nothing():
    dv = np.arange(4.0)
    assert fill(dv, np.zeros(4, bool), np.eye(4)) is dv
