"""Places that a pattern cannot tell apart, against voltages of the forward model."""

import numpy as np
import pytest

from tomoskin.model.forward import ForwardModel
from tomoskin.model.pattern import Pattern
from tomoskin.model.skin import Skin
from tomoskin.model.skin.symmetry import unseen_symmetries

NAMES = ("textile-disc-8", "textile-disc-16", "textile-square-16")


def opposite_pairs(n):
    """Opposite electrodes driven, and read by the other opposite pairs."""
    rows = [(k, j) for k in range(n // 2) for j in range(n // 2) if j != k]
    table = {
        "drive": [[k + n // 2, k] for k, _ in rows],
        "measure": [[j, j + n // 2] for _, j in rows],
    }
    return {"drive": {"pattern": None, **table}, "mesh": {"cells": 1200}}


def ambiguity(skin):
    return skin.ambiguity(lambda: model(skin).jacobian(skin.conductivity))


def model(skin):
    return ForwardModel(skin.mesh(), skin.pattern(), skin.contact_impedance, skin.current)


def change(skin, x, y):
    """V of a smooth press at (x, y) m."""
    far = np.linalg.norm(skin.mesh().centroids - [x, y], axis=1)
    pressed = skin.conductivity * (1 - 0.3 * np.exp(-((far / 0.015) ** 2)))
    forward = model(skin)
    return forward.solve(pressed).voltages - forward.solve(skin.conductivity).voltages


@pytest.mark.parametrize("name", NAMES)
def test_opposite_pairs_do_not_tell_a_press_from_one_at_the_point_across(name):
    skin = Skin.load(name).altered(opposite_pairs(Skin.load(name).n_electrodes))
    found = ambiguity(skin)
    assert found.elsewhere(-0.05, -0.03) == (pytest.approx((0.05, 0.03)),)
    assert "turned by 180°" in found.text
    here, across, aside = (change(skin, *p) for p in ((-0.03, -0.02), (0.03, 0.02), (-0.03, 0.02)))
    assert np.linalg.norm(here - across) < 0.01 * np.linalg.norm(here)
    assert np.linalg.norm(here - aside) > 0.3 * np.linalg.norm(here)


def test_the_middle_is_no_two_places():
    skin = Skin.load("textile-disc-8").altered(opposite_pairs(8))
    assert ambiguity(skin).elsewhere(0.001, 0.002) == ()


def test_the_pattern_that_is_advised_tells_all_places_apart():
    skin = Skin.load("textile-disc-16").altered(opposite_pairs(16))
    kind, _, name = ambiguity(skin).instead.partition(" = ")
    other = skin.altered({"drive": {kind: name.strip('"'), "drive": None, "measure": None}})
    assert ambiguity(other) is None
    apart = change(other, -0.03, -0.02) - change(other, 0.03, 0.02)
    assert np.linalg.norm(apart) > 0.3 * np.linalg.norm(change(other, 0.03, 0.02))


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("pattern", ["adjacent", "opposite", "skip:2", "all_pairs"])
def test_named_patterns_tell_all_places_apart(name, pattern):
    skin = Skin.load(name).altered({"drive": {"pattern": pattern}})
    assert not skin.unseen_symmetries


def test_rows_that_drive_and_read_change_places_are_the_same_rows():
    """Four electrodes, adjacent: the row across is read across, by reciprocity."""
    skin = Skin.load("textile-disc-8").altered({"electrodes": {"count": 4}})
    places = ambiguity(skin).elsewhere(0.03, 0.01)
    assert any(place == pytest.approx((-0.03, -0.01)) for place in places)


def test_a_mirror_that_reverses_both_pairs_leaves_a_row_as_it_is():
    """E1 and E5 lie on the y axis, E2 and E4 across the x axis, and so do E8 and E6."""
    skin = Skin.load("textile-disc-8")
    rows = Pattern.from_tables([[0, 4], [0, 4]], [[1, 3], [7, 5]], 8)
    (found,) = unseen_symmetries(rows, skin.outline, skin.electrode_centres)
    assert found.text == "mirrored at the line through the centre at 0° from +x"
    np.testing.assert_allclose(found.moved(np.array([[0.02, 0.03]])), [[0.02, -0.03]], atol=1e-12)
    one_way = Pattern.from_tables([[0, 4], [0, 4]], [[1, 3], [7, 6]], 8)
    assert not unseen_symmetries(one_way, skin.outline, skin.electrode_centres)


@pytest.mark.parametrize(("shift", "hard"), [(2.0, True), (12.0, False)])
def test_a_sheet_that_is_nearly_symmetric_is_told_by_its_voltages(shift, hard):
    """One of the electrodes off its place by mm; between electrodes are 78 mm."""
    skin = Skin.load("textile-disc-8").altered(opposite_pairs(8))
    centres = 1e3 * skin.electrode_centres
    along = np.array([centres[0, 1], -centres[0, 0]]) / np.linalg.norm(centres[0])
    centres[0] = (centres[0] + shift * along) * (
        np.linalg.norm(centres[0]) / np.linalg.norm(centres[0] + shift * along)
    )
    positions = [[f"{x:.5f} mm", f"{y:.5f} mm"] for x, y in centres]
    moved = {"positions": positions, "count": None, "first": None, "order": None}
    found = ambiguity(skin.altered({"electrodes": moved}))
    assert (found is not None) == hard
    if hard:
        assert 1e-3 < found.difference < 0.1


def test_unequal_contacts_do_not_hide_that_places_look_the_same():
    skin = Skin.load("textile-square-16").altered(opposite_pairs(16))
    rng = np.random.default_rng(0)
    contacts = skin.contact_impedance * np.exp(rng.uniform(-1, 1, 16))
    uneven = skin.altered({"electrodes": {"contact_impedance": [f"{z} ohm*m" for z in contacts]}})
    assert ambiguity(skin).difference < ambiguity(uneven).difference < 0.05
