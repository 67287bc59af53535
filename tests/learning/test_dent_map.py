"""The dent of touches with depths: closed forms against integrals, and what makes no map."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.special import j0

from tomoskin.core import Amount, DataError, Detection
from tomoskin.learning import dent_map
from tomoskin.learning.amount.dent_map import fall

TIP = (0.01, 0.0)
DEPTH = Amount(1e-3, 0.8e-3, 1.2e-3)
TOUCH = Detection(0.0, 0.0, 1e-4, 1e-4, 3e-4, -0.5, np.empty(0, np.int64), depth=DEPTH)
LINE = np.column_stack([np.linspace(0, 0.08, 161), np.zeros(161)])


def test_a_thick_layer_is_a_half_space_and_a_thin_one_gives_way_under_the_tip_alone():
    away = np.array([0.0, 0.005, 0.01, 0.012, 0.02, 0.05])
    free = 2 / np.pi * np.arcsin(0.01 / np.maximum(away, 0.01))
    assert fall(away, 0.01, 100.0) == pytest.approx(free, abs=1e-3)
    assert fall(away, 0.01, 1e-5)[3:] == pytest.approx(0.0, abs=1e-3)
    tails = [fall(away, 0.01, layer)[-2] for layer in (1e-3, 3e-3, 10e-3, 30e-3, 0.3)]
    assert tails == sorted(tails)
    assert fall(away, 0.01, 3e-3)[:3].tolist() == [1.0, 1.0, 1.0]


def test_the_fall_is_the_integral_over_waves():
    """Of a flat tip's pressure on a half-space, with the compliance of the layer."""
    a, t, q = 0.01, 0.006, np.linspace(1e-3, 8000, 80001)
    mirrored = (3 * np.exp(-q * t) - np.exp(-2 * q * t)) / 2 * np.sin(q * a) / q

    def deflection(r):
        return np.arcsin(a / r) - np.trapezoid(mirrored * j0(q * r), q)

    for r in (0.012, 0.015, 0.02):
        expected = max(deflection(r) / deflection(a), 0.0)
        assert fall(np.array(r), a, t) == pytest.approx(expected, abs=1e-3)


def test_the_compliance_is_that_of_a_glued_layer():
    x = np.linspace(0.01, 8, 200)
    exact = (3 * np.sinh(x) * np.cosh(x) - x) / (3 * np.cosh(x) ** 2 + x**2 + 1)
    assert 1 - (3 * np.exp(-x) - np.exp(-2 * x)) / 2 == pytest.approx(exact, abs=0.04)


def test_the_middle_has_the_depth_of_the_touch_and_its_deviation():
    depth, sd = dent_map([TOUCH], LINE, 3e-3, TIP)
    assert depth[0] == pytest.approx(1e-3, rel=1e-6)
    assert sd[0] == pytest.approx(0.2e-3 / 1.645, rel=1e-3)
    assert np.all(np.diff(depth) <= 1e-12)
    assert depth[-1] < 0.05e-3
    two = dent_map([TOUCH, replace(TOUCH, x=0.06)], LINE, 30e-3, TIP)
    ours, other = (dent_map([replace(TOUCH, x=x)], LINE, 30e-3, TIP) for x in (0.0, 0.06))
    assert two.deflection == pytest.approx(ours.deflection + other.deflection)
    assert two.deviation == pytest.approx(np.hypot(ours.deviation, other.deviation))


def test_what_is_not_known_of_place_and_tip_is_in_the_deviation():
    """Most at the edge of the tip, along the direction that is not known."""
    square = np.array([[0.01, 0.0], [0.0, 0.01]])
    sure = dent_map([TOUCH], square, 3e-3, TIP).deviation
    vague = dent_map([replace(TOUCH, sd_x=4e-3)], square, 3e-3, TIP).deviation
    assert vague[0] > 1.2 * sure[0]
    assert vague[1] == pytest.approx(sure[1])
    any_tip = dent_map([TOUCH], square, 3e-3).deviation
    assert (any_tip > 2 * sure).all()
    unknown = dent_map([replace(TOUCH, sd_x=math.nan, sd_y=math.nan)], square, 3e-3, TIP)
    assert np.isfinite(unknown.deviation).all()


def test_beyond_what_was_taught_and_beyond_the_layer():
    endless = replace(TOUCH, depth=Amount(1e-3, 0.8e-3, math.inf))
    assert dent_map([endless], LINE, 3e-3, TIP).deviation[0] == pytest.approx(0.1216e-3, rel=1e-3)
    assert dent_map([TOUCH] * 5, LINE, 3e-3, TIP).deflection[0] == 3e-3


def test_an_uncalibrated_touch_gives_no_map():
    assert dent_map([TOUCH, replace(TOUCH, depth=None)], LINE, 3e-3) is None
    assert dent_map([], LINE, 3e-3).deflection.tolist() == [0.0] * len(LINE)


def test_what_cannot_be_mapped_is_said():
    with pytest.raises(DataError, match="thickness of the layer") as raised:
        dent_map([TOUCH], LINE, None)
    assert "[surface]" in str(raised.value)
    with pytest.raises(DataError, match="expected a tip with a radius above 0 m, got 0 ± 0"):
        dent_map([TOUCH], LINE, 3e-3, (0.0, 0.0))
