"""The twin's sheet bent and stretched: exact where that is known, linear where it is small."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from tomoskin.core import GeometryError
from tomoskin.model.forward import ForwardModel
from tomoskin.model.mesh import Arm, Cap, Cylinder, Hinge, Plane, Saddle
from tomoskin.model.pattern import Pattern
from tomoskin.model.skin import Skin
from tomoskin.twin import (
    BendSettings,
    Bent,
    MaterialSettings,
    Stretched,
    TwinSettings,
    TwinSkin,
    make_electronics,
)
from tomoskin.twin.bend import layer_metric, strain_of

GEOMETRY = MaterialSettings(gauge=0.0, gauge_across=2.0)
"""A sheet whose material conducts on as it did, whatever its strain."""

SIDES = [["0 mm", "40 mm"], ["60 mm", "0 mm"], ["0 mm", "-40 mm"], ["-60 mm", "0 mm"]]
UV = np.array([[0.0, 0.0], [0.03, 0.01], [-0.02, 0.04]])


def twin(name="textile-disc-8", *, height=3e-3, material=None, changes=None):
    settings = replace(
        TwinSettings(), bend=BendSettings(height), material=material or MaterialSettings()
    )
    return TwinSkin.of(Skin.load(name).altered(changes or {}), settings)


def resistance(sheet, *pose):
    sheet.set_pose(pose)
    return sheet.resistance().copy()


def apart(a, b):
    return np.abs(a - b).max() / np.abs(b).max()


@pytest.mark.parametrize("surface", [Cylinder(0.04, 0.3), Hinge(2.0, 0.05, 1.0, 0.02)], ids=str)
def test_flat_and_unrolled_agree_where_the_layer_keeps_its_length(surface):
    sheet = twin(height=0.0, material=MaterialSettings(gauge_across=5.0))
    assert apart(resistance(sheet, Bent(surface)), resistance(sheet)) < 1e-10


@pytest.mark.parametrize("stretch", [(0.2, 0.0), (0.1, 0.25), (-0.1, 0.05)])
def test_a_stretch_equals_the_stretched_mesh(stretch):
    """A rectangle whose electrodes lie along its sides, contacts as good a metre as they were."""
    sides = {
        "outline": {"shape": "rectangle", "diameter": None, "width": "120 mm", "height": "80 mm"},
        "electrodes": {
            "count": None,
            "first": None,
            "order": None,
            "positions": SIDES,
            "contact_impedance": "2 mohm*m",
        },
    }
    sheet = twin(material=GEOMETRY, changes=sides)
    got = resistance(sheet, Stretched(*stretch))
    mesh = sheet.model.mesh
    grown = 1 + np.array(stretch)
    moved = replace(mesh, points=mesh.points * grown)
    z = sheet.model.contact_impedance * np.array([grown[0], grown[1]] * 2)
    model = ForwardModel(moved, Pattern.adjacent(4), z)
    base = twin(material=GEOMETRY, changes=sides)
    assert apart(got, model.at(base.conductivity()).transfer_resistance) < 1e-10


def test_a_turned_stretch_is_the_turned_strain():
    along = strain_of((Stretched(0.1, axis=math.pi / 6),), UV, Plane(), 0.0)[0]
    xx, yy, xy = along
    assert np.linalg.eigvalsh([[xx, xy], [xy, yy]]) == pytest.approx([0, math.log(1.1)], abs=1e-12)
    assert math.atan2(xy, xx) == pytest.approx(math.pi / 6)


@pytest.mark.parametrize(
    ("surface", "metric"),
    [
        (Cylinder(0.05), np.diag([(1 + 3e-3 / 0.05) ** 2, 1.0])),
        (Hinge(-1.0, 0.5), np.diag([(1 - 3e-3 * 2) ** 2, 1.0])),
    ],
)
def test_the_layer_is_as_long_as_its_own_radius_says(surface, metric):
    assert layer_metric(surface, UV, 3e-3) == pytest.approx(np.tile(metric, (3, 1, 1)), abs=1e-7)


def test_the_layer_above_a_sphere_is_that_of_a_larger_sphere():
    grown = (1 + 3e-3 / 0.1) ** 2 * Cap(0.1).metric(UV)
    assert layer_metric(Cap(0.1), UV, 3e-3) == pytest.approx(grown, abs=1e-6)


def test_a_joint_strains_the_skin_by_its_own_rest():
    straight, bent = Arm(0.03, 0.0, 0.1), Arm(0.03, 0.5, 0.1)
    strain = Bent(bent).strain(np.zeros((1, 2)), straight, 3e-3)[0]
    assert strain == pytest.approx([0, math.log(1 + 33e-3 * 5), 0], abs=1e-6)


def test_small_bends_are_linear():
    sheet = twin()
    rest = resistance(sheet)
    one, two = (resistance(sheet, Bent(Hinge(a, 0.1))) - rest for a in (1e-3, 2e-3))
    assert apart(two, 2 * one) < 2e-3
    assert np.abs(one).max() > 1e-5 * np.abs(rest).max()


def test_bends_to_both_sides_are_opposite_to_first_order():
    sheet = twin()
    rest = resistance(sheet)
    up, down = (resistance(sheet, Bent(Hinge(a, 0.1))) - rest for a in (1e-3, -1e-3))
    assert apart(up, -down) < 2e-3


def test_a_symmetric_bend_gives_symmetric_voltages():
    """The axis runs through E1 and E5; the mesh itself is symmetric only as far as it is fine."""
    sheet = twin()
    x, y = sheet.model.mesh.centroids.T
    mirrored = strain_of((Bent(Hinge(1.0, 0.1)),), np.column_stack([-x, y]), Plane(), 3e-3)
    strain = strain_of((Bent(Hinge(1.0, 0.1)),), np.column_stack([x, y]), Plane(), 3e-3)
    assert mirrored == pytest.approx(strain, abs=1e-12)
    skin = Skin.load("textile-disc-8").altered({"mesh": {"cells": 4000}})
    fine = TwinSkin.of(skin, TwinSettings())
    rest = resistance(fine)
    change = resistance(fine, Bent(Hinge(1.0, 0.1))) - rest
    swap = -np.arange(8) % 8  # E1 is at the top: left and right change places
    assert apart(change[swap][:, swap], change) < 0.02
    turned = resistance(fine, Bent(Hinge(1.0, 0.1, axis=0.0))) - rest
    assert apart(turned, change) > 0.2
    quarter = np.roll(np.arange(8), 2)
    assert apart(turned[quarter][:, quarter], change) < 0.02


def test_a_bend_lasts_until_it_is_taken_back_and_a_press_adds_to_it():
    from tomoskin.twin import Press

    sheet = twin()
    rest = resistance(sheet)
    press = (Press(0.02, 0.0, 3.0, 0.012),)
    sheet.set_presses(press)
    pressed = sheet.load[:3].T.copy()
    sheet.set_pose((Bent(Cylinder(0.1)),))
    both = sheet.load[:3].T.copy()
    sheet.set_presses(())
    assert both - sheet.load[:3].T == pytest.approx(pressed, abs=1e-12)
    sheet.set_pose(())
    assert apart(sheet.resistance(), rest) < 1e-9


def test_renewed_sheets_lie_as_at_rest():
    sheet = twin()
    rest = resistance(sheet)
    bent = resistance(sheet, Bent(Cylinder(0.1)))
    assert apart(bent, rest) > 0.01
    sheet.renew()
    assert sheet.pose == ()
    assert apart(sheet.resistance(), rest) < 1e-12


def test_a_sheet_on_its_own_surface_is_at_rest_there():
    flat, curved = twin(), twin(changes={"surface": {"shape": "cylinder", "radius": "60 mm"}})
    assert apart(curved.resistance(), flat.resistance()) < 1e-10
    there = resistance(curved, Bent(Cylinder(0.06)))
    assert apart(there, flat.resistance()) < 1e-10


@pytest.mark.parametrize(
    ("pose", "message"),
    [
        ((Bent(Cylinder(0.02)),), "overlaps itself"),
        ((Bent(Hinge(-3.0, 8e-3)),), "folds"),
        ((Bent(Hinge(4.0, 0.1)),), "at most 180°"),
    ],
)
def test_impossible_shapes_are_refused_and_nothing_changes(pose, message):
    sheet = twin()
    before = (Bent(Saddle(0.5, 0.5)),)
    sheet.set_pose(before)
    with pytest.raises(GeometryError, match=message):
        sheet.set_pose(pose)
    assert sheet.pose is before


@pytest.mark.parametrize("along", [-0.6, 1.5, math.nan])
def test_impossible_stretches_are_refused(along):
    with pytest.raises(GeometryError, match="elongation"):
        Stretched(along)


def test_a_hinge_of_more_than_a_turn_is_refused():
    with pytest.raises(GeometryError, match="360°"):
        Hinge(7.0, 0.1)


def test_a_bend_moves_during_a_scan():
    """Each drive sees the sheet as it is in its middle; what stands still costs one solution."""
    from tomoskin.board.wire import Drive
    from tomoskin.model.pattern import Scan
    from tomoskin.twin import ScanClock, sample_table

    skin = Skin.load("textile-disc-8")
    board = make_electronics(skin, TwinSettings().with_noise(0.0))
    scan = Scan.of(skin.pattern())
    drives = [
        Drive(int(a), int(b), int(m)) for (a, b), m in zip(scan.drives, scan.masks, strict=True)
    ]
    table = sample_table(drives, 4, ScanClock(0.0, 2e-3, 1e-4))

    def bent(angle):
        board.follow(None, lambda _: (Bent(Hinge(angle, 0.2)),))
        return board.sample(table, 0.0).astype(float)

    still, far = bent(0.0), bent(1.0)
    assert np.abs(far - still).max() > 20
    solves = board.sheet.solves
    board.follow(None, lambda t: (Bent(Hinge(t / table.seconds, 0.2)),))
    moving = board.sample(table, 0.0).astype(float)
    assert board.sheet.solves == solves + len(drives)
    part = table.drive / (len(drives) - 1)
    moved = np.abs(moving - still)
    assert moved[part < 0.1].max() < 0.2 * moved[part > 0.9].max()
    assert board.sheet.pose == (Bent(Hinge(table.middles[-1] / table.seconds, 0.2)),)
