"""The dent against the equation it solves, and what is refused."""

import math

import numpy as np
import pytest
from scipy.integrate import quad

from tomoskin.core import GeometryError, ModelError
from tomoskin.mesh import Disc
from tomoskin.twin import ContactSettings, Press, depth, relative_conductivity
from tomoskin.twin.press import check_on_skin

SETTINGS = ContactSettings()
PRESS = Press(0.01, -0.02, 3.0, 0.015)


def along(r, press=PRESS):
    r = np.atleast_1d(r)
    return depth(press, SETTINGS, np.column_stack([press.x + r, np.full_like(r, press.y)]))


def test_the_foam_carries_the_force():
    ring = quad(lambda r: SETTINGS.foundation * along(r)[0] * 2 * math.pi * r, 0, 0.4, limit=200)
    assert ring[0] == pytest.approx(PRESS.force, rel=1e-6)


@pytest.mark.parametrize("r", [0.002, 0.007, 0.014, 0.016, 0.03])
def test_the_membrane_equation_holds(r):
    h = 1e-5
    left, here, right = along(np.array([r - h, r, r + h]))
    laplacian = (left - 2 * here + right) / h**2 + (right - left) / (2 * h) / r
    pressure = PRESS.force / (math.pi * PRESS.radius**2) if r < PRESS.radius else 0.0
    scale = PRESS.force / (math.pi * PRESS.radius**2)
    left_side = SETTINGS.tension * laplacian - SETTINGS.foundation * here
    assert left_side / scale == pytest.approx(-pressure / scale, abs=1e-4)


def test_depth_and_slope_are_continuous_at_the_probes_rim():
    h = 1e-7
    a, b, c, d = along(PRESS.radius + np.array([-2 * h, -h, h, 2 * h]))
    assert b == pytest.approx(c, rel=1e-4)
    assert (b - a) / h == pytest.approx((d - c) / h, rel=1e-3)


def test_depth_is_linear_in_force_and_a_wide_probe_reaches_the_foams_limit():
    assert along(0.0, Press(0, 0, 6.0, 0.015)) == pytest.approx(
        2 * along(0.0, Press(0, 0, 3.0, 0.015))
    )
    wide = Press(0, 0, 100.0, 1.0)
    assert along(0.0, wide)[0] == pytest.approx(100.0 / math.pi / SETTINGS.foundation, rel=1e-6)


def test_extreme_sizes_stay_finite():
    points = np.array([[0.0, 0.0], [0.1, 0.0], [50.0, 0.0]])
    for radius in (1e-6, 1e-3, 100.0):
        assert np.isfinite(depth(Press(0, 0, 1.0, radius), SETTINGS, points)).all()


def test_conductivity_falls_most_under_the_probe_and_presses_add_up():
    points = np.array([[0.01, -0.02], [0.03, -0.02], [0.09, 0.0]])
    one = relative_conductivity((PRESS,), SETTINGS, points)
    assert 0.3 < one[0] < 0.9
    assert one[0] < one[1] < one[2] <= 1.0
    assert one[2] == pytest.approx(1.0, abs=1e-3)
    two = relative_conductivity((PRESS, PRESS), SETTINGS, points)
    assert 1 / two - 1 == pytest.approx(2 * (1 / one - 1))
    assert relative_conductivity((), SETTINGS, points).tolist() == [1.0, 1.0, 1.0]
    resting = Press(0.01, -0.02, 0.0, 0.015)
    assert relative_conductivity((resting,), SETTINGS, points).tolist() == [1.0, 1.0, 1.0]


@pytest.mark.parametrize(
    ("values", "error", "said"),
    [
        ((math.nan, 0, 1, 0.01), GeometryError, "finite place"),
        ((0, math.inf, 1, 0.01), GeometryError, "finite place"),
        ((0, 0, 1, 0.0), GeometryError, "radius above 0"),
        ((0, 0, 1, math.nan), GeometryError, "radius above 0"),
        ((0, 0, -0.1, 0.01), ModelError, "push, not pull"),
        ((0, 0, math.nan, 0.01), ModelError, "force of 0 N or more"),
    ],
)
def test_impossible_presses(values, error, said):
    with pytest.raises(error, match=said):
        Press(*values)


def test_a_press_off_the_skin_is_named():
    inside, outside = Press(0, 0, 1, 0.01), Press(0.2, 0, 1, 0.01)
    check_on_skin((), Disc(0.1))
    check_on_skin((inside,), Disc(0.1))
    with pytest.raises(GeometryError, match=r"press 1: its centre \(200.0 mm, 0.0 mm\) is off"):
        check_on_skin((inside, outside), Disc(0.1))
