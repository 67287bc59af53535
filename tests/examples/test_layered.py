"""A rigid plate on a soft body with stiff inclusions."""

from __future__ import annotations

import importlib
import math
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tomoskin.core import GeometryError, ModelError
from tomoskin.model.mesh import Plane
from tomoskin.model.skin import Skin
from tomoskin.twin import ContactSettings, TwinSettings, TwinSkin

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "examples"))
layered = importlib.import_module("layered")
sys.path.pop(0)
Inclusion, Layered, Plate = layered.Inclusion, layered.Layered, layered.Plate

FOAM = ContactSettings(modulus=5e3, thickness=30e-3)
BALL = Inclusion(5e-3, -10e-3, 10e-3, 4e-3)


def plate(*inclusions, force=2.0, side=90e-3):
    return Plate(Layered(FOAM, 100e-3, inclusions), force, side)


def carried(pressed):
    """N: of the pressure on the grid, whose nodes under the plate are as large as it."""
    pressure = pressed.pressure
    under = np.abs(pressed.body.grid.points).max(axis=1) < pressed.side / 2
    return pressure.sum() * pressed.side**2 / under.sum()


def test_without_an_inclusion_all_of_it_is_pressed_alike():
    pressed = plate()
    even = 2.0 / 0.09**2
    inside = np.array([[0.0, 0.0], [0.03, -0.04], [-0.043, 0.043]])
    assert pressed.travel == pytest.approx(even * FOAM.thickness / FOAM.modulus)
    assert pressed.depth(inside) == pytest.approx(np.full(3, pressed.travel))
    assert pressed.depth(np.array([[0.049, 0.0]])) == 0


@pytest.mark.parametrize("room", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("force", [0.02, 2.0])
def test_the_foam_carries_the_force(room, force):
    ball = replace(BALL, room=room)
    assert carried(plate(ball, force=force)) == pytest.approx(force, rel=1e-9)


def test_a_light_plate_stands_on_what_lies_between_the_layers():
    raised = plate(replace(BALL, room=0.0), force=0.02)
    assert raised.travel < 0
    corner = np.array([[-0.04, 0.04]])
    assert raised.depth(corner) == 0
    assert plate(BALL, force=0.02).depth(corner) > 0


def test_over_a_small_disc_the_share_is_boussinesqs():
    """Of a column's extra stiffness, 1 − (1 + (a/h)²)^(−3/2) comes to lie within the radius a."""
    depth, radius = 6e-3, 9e-3
    ball = Inclusion(0.0, 0.0, 3e-3, depth)
    body = Layered(FOAM, 100e-3, (ball,))
    extra = body.stiffness() - FOAM.spring
    near = np.linalg.norm(body.grid.points, axis=1).reshape(extra.shape) < radius
    share = 1 - (1 + (radius / depth) ** 2) ** -1.5
    assert extra[near].sum() / extra.sum() == pytest.approx(share, rel=0.06)


def test_springs_through_a_ball_are_shorter():
    """∫(k − k₀) over a rigid ball: 2π ∫ r E/(t − 2√(R² − r²)) dr less πR²E/t, in closed form."""
    t, r = FOAM.thickness, BALL.diameter / 2
    whole = math.pi / 2 * FOAM.modulus * (t * math.log(t / (t - 2 * r)) - 2 * r)
    body = Layered(FOAM, 100e-3, (BALL,))
    extra = (body.stiffness() - FOAM.spring).sum() * body.grid.step**2
    assert extra == pytest.approx(whole - math.pi * r**2 * FOAM.spring, rel=0.05)


def test_laid_between_it_lifts_by_its_volume():
    body = Layered(FOAM, 100e-3, (replace(BALL, room=0.0),))
    volume = math.pi / 6 * BALL.diameter**3
    assert body.lift().sum() * body.grid.step**2 == pytest.approx(FOAM.spring * volume, rel=0.05)
    assert body.stiffness() == pytest.approx(FOAM.spring)


@pytest.mark.parametrize("room", [0.0, 1.0])
def test_deeper_is_weaker_and_wider_and_softer_is_weaker(room):
    ball = replace(BALL, room=room)
    high, width = _spot(ball)
    low, wide = _spot(replace(ball, depth=8e-3))
    soft, _ = _spot(replace(ball, modulus=2e4))
    smaller, _ = _spot(replace(ball, diameter=8e-3))
    assert low < 0.8 * high
    assert wide > 1.2 * width
    assert soft < high
    assert smaller < 0.8 * high


def _spot(ball):
    """Greatest pressure above the plain one, Pa, and the radius of half of it, m."""
    pressed = plate(ball)
    extra = pressed.pressure - np.median(pressed.pressure[pressed.pressure > 0])
    area = (extra > extra.max() / 2).sum() * pressed.body.grid.step**2
    return float(extra.max()), math.sqrt(area / math.pi)


def test_foam_that_spreads_stretches_the_sheet_most_over_the_ball():
    uv = np.array([[5e-3, -10e-3], [-30e-3, 30e-3]])
    over, away = plate(replace(BALL, room=0.0)).strain(uv, Plane(), 0.0)[:, :2].mean(axis=1)
    assert over > away > 0
    stiff = Plate(Layered(replace(FOAM, bulge=0.0), 100e-3, (BALL,)), 2.0)
    assert stiff.strain(uv, Plane(), 0.0) == pytest.approx(0.0)


def test_a_twin_feels_it_as_compression():
    settings = TwinSettings.preset("ideal")
    material = replace(settings.material, compression=1.0, thickness=FOAM.thickness)
    sheet = TwinSkin.of(Skin.load("textile-square-16"), replace(settings, material=material))
    before = sheet.conductivity().copy()
    body = Layered(replace(FOAM, bulge=0.0), 100e-3, (replace(BALL, room=0.0),))
    sheet.set_pose((Plate(body, 2.0),))
    rise = sheet.conductivity() / before - 1
    most = sheet.model.mesh.centroids[rise.argmax()]
    assert np.linalg.norm(most - (BALL.x, BALL.y)) < 2e-3
    middle = np.abs(sheet.model.mesh.centroids).max(axis=1) < 40e-3
    assert np.median(rise[middle]) == pytest.approx(2.0 / 0.09**2 / FOAM.modulus, rel=0.1)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"x": math.nan}, "expected a finite position"),
        ({"diameter": 0.0}, "diameter and a depth above 0"),
        ({"depth": -1e-3}, "diameter and a depth above 0"),
        ({"modulus": 0.0}, "modulus above 0"),
        ({"room": 1.5}, "fraction from 0 to 1 as room"),
        ({"x": 47e-3}, "inclusion 0: it extends beyond"),
        (
            {"depth": 25e-3},
            "inclusion 0: it extends to a depth of 35 mm, but the body is 30 mm thick",
        ),
    ],
)
def test_impossible_inclusions_are_refused(change, said):
    with pytest.raises((GeometryError, ModelError), match=said):
        Layered(FOAM, 100e-3, (replace(BALL, **change),))


def test_inclusions_that_overlap_and_impossible_plates_are_refused():
    with pytest.raises(GeometryError, match="inclusion 1: it overlaps another"):
        Layered(FOAM, 100e-3, (BALL, replace(BALL, x=12e-3)))
    with pytest.raises(ModelError, match="a force of 0 N or more, got -1"):
        plate(force=-1.0)
    with pytest.raises(GeometryError, match="a plate of at most 100 mm, got 120 mm"):
        plate(side=0.12)
