"""Probes and presses: what is refused, and by which name."""

import math

import numpy as np
import pytest

from tomoskin.core import GeometryError, ModelError
from tomoskin.model.mesh import Disc
from tomoskin.twin import FACES, Circle, ContactSettings, Face, Finger, Press, Probe, Square
from tomoskin.twin.dent import indent
from tomoskin.twin.probe import check_on_skin


@pytest.mark.parametrize(
    ("values", "error", "said"),
    [
        ((math.nan, 0, 1, 0.01), GeometryError, "finite position"),
        ((0, math.inf, 1, 0.01), GeometryError, "finite position"),
        ((0, 0, 1, 0.0), GeometryError, "expected radius of 1 µm or more"),
        ((0, 0, 1, math.nan), GeometryError, "expected radius of 1 µm or more"),
        ((0, 0, -0.1, 0.01), ModelError, "can only push"),
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


def test_a_press_is_a_flat_round_probe():
    press = Press(0.01, 0.02, 3.0, 0.015)
    settings, points = ContactSettings(), 0.03 * np.random.default_rng(5).standard_normal((50, 2))
    probe = Probe(press.shape, press.x, press.y, press.force, press.angle, press.drag)
    assert probe == Probe(Circle(0.015), 0.01, 0.02, 3.0)
    assert probe.radius == pytest.approx(0.015)
    one, other = (indent([contact], settings, points) for contact in (press, probe))
    assert (one[3] == other[3]).all()
    assert one[3].max() > 0


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: Circle(0.0), "expected radius of 1 µm or more"),
        (lambda: Circle(0.01, -1.0), "expected crown of 1 µm or more"),
        (lambda: Square(math.nan), "expected side of 1 µm or more"),
        (lambda: Finger(across=math.inf), "expected across of 1 µm or more"),
        (lambda: FACES["finger"](1e-300), "expected length of 1 µm or more"),
        (lambda: Face(((0, 0), (0.01, 0.01), (0.01, 0), (0, 0.01))), "cross"),
        (lambda: Face(((0, 0), (0.01, 0.0))), "at least 3"),
        (lambda: Face(((0, 0), (0.01, 0.0), (0.02, 0.0))), "area|touch|cross|side"),
        (lambda: Probe(Circle(0.01), 0, math.nan, 1), "finite position"),
        (lambda: Probe(Circle(0.01), 0, 0, 1, math.inf), "finite angle"),
    ],
)
def test_impossible_shapes_and_places(make, said):
    with pytest.raises(GeometryError, match=said):
        make()


def test_impossible_forces():
    with pytest.raises(ModelError, match="can only push"):
        Probe(Circle(0.01), 0, 0, -1.0)
    with pytest.raises(ModelError, match="finite drag"):
        Probe(Circle(0.01), 0, 0, 1.0, 0.0, (0.0, math.nan))


def test_a_moving_probe_drags_with_friction_times_force_the_way_it_goes():
    probe = Probe(Circle(0.01), 0, 0, 2.0)
    assert probe.moving(3.0, 4.0, 0.5).drag == pytest.approx((0.6, 0.8))
    assert probe.moving(0.0, 0.0, 0.5).drag == (0.0, 0.0)
