"""The scales of colours: their numbers, how they look, and that pictures and films use them."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from PIL import Image as Pillow

from core.seeing import EYES, blue_beside_red, seen
from files.session.runs import TOUCH
from shapes import disc
from tomoskin.core import AMOUNT, CHANGE, CHANGE_ON_DARK, DataError
from tomoskin.files.exports import FILMS, Panel, write_picture
from tomoskin.files.exports.picture import rendered
from tomoskin.files.messages import Contact, scene_message
from tomoskin.model.mesh import Plane

KNOWN = {
    CHANGE: {
        -1: "#0858af", -0.5: "#7aadf1", -0.1: "#dfecfd",
        0: "#fafafa",
        0.1: "#fce4e1", 0.5: "#e98e83", 1: "#a02a26",
    },
    CHANGE_ON_DARK: {
        -1: "#55abf7", -0.5: "#256093", -0.1: "#232d38",
        0: "#222222",
        0.1: "#382826", 0.5: "#8d433d", 1: "#f07f76",
    },
}  # fmt: skip
"""Colours of values against their limit; web/test/colours.test.ts asks the page for the same."""

SIGNED = pytest.mark.parametrize("scale", KNOWN, ids=lambda scale: scale.name)
EVERY = pytest.mark.parametrize("scale", [*KNOWN, AMOUNT], ids=lambda scale: scale.name)


def at(scale, value):
    """Levels of a value against its limit."""
    return scale.table[round((value + 1) / 2 * (len(scale.table) - 1))].astype(int)


@SIGNED
def test_colours_are_those_of_the_page(scale):
    for value, colour in KNOWN[scale].items():
        assert np.abs(at(scale, value) - [*bytes.fromhex(colour[1:])]).max() <= 1


@SIGNED
def test_a_fall_is_blue_and_a_rise_is_red(scale):
    red, _, blue = scale.table.T.astype(int)
    middle = len(scale.table) // 2
    assert (blue > red)[:middle].all()
    assert (red > blue)[middle + 1 :].all()
    assert len(set(scale.table[middle])) == 1


@SIGNED
def test_falls_and_rises_weigh_the_same(scale):
    """Lightness and distance from none are equal on both sides."""
    lab = seen(scale.table)
    assert lab[::-1, 0] == pytest.approx(lab[:, 0], abs=0.008)
    chroma = np.hypot(lab[:, 1], lab[:, 2])
    assert chroma[::-1] == pytest.approx(chroma, abs=0.008)


@EVERY
def test_equal_steps_look_equal(scale):
    steps = np.linalg.norm(np.diff(seen(scale.table[::17]), axis=0), axis=1)
    assert steps.max() / steps.min() < 1.3


@EVERY
@pytest.mark.parametrize("eye", EYES)
def test_every_eye_reads_it(scale, eye):
    """Lightness runs one way from none, or the least; a fall and a rise never look alike."""
    lab = seen(scale.table, eye)
    if scale is AMOUNT:
        assert (np.diff(lab[::15, 0]) < 0).all()
        return
    middle = len(lab) // 2
    away = 1 if scale is CHANGE_ON_DARK else -1
    for arm in (lab[middle::-15, 0], lab[middle::15, 0]):
        assert (away * np.diff(arm) > 0).all()
    falls, rises = lab[middle - 50 :: -1], lab[middle + 50 :]
    apart = np.linalg.norm(falls[:, None] - rises[None], axis=2)
    assert apart.min() > 0.04


def test_amounts_look_like_no_change():
    """Where they have a colour at all: green, neither blue nor red."""
    red, green, blue = AMOUNT.table.T.astype(int)
    assert (green >= np.maximum(red, blue) - 1).all()


@EVERY
def test_matplotlib_has_the_same(scale):
    pytest.importorskip("matplotlib")
    colormap = scale.colormap()
    middle = scale.table[len(scale.table) // 2]
    for value, levels in ((0.0, scale.table[0]), (0.5, middle), (1.0, scale.table[-1])):
        assert np.array(colormap(value, bytes=True)[:3]) == pytest.approx(levels, abs=1)


def test_without_matplotlib_it_says_what_to_do(monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib.colors", None)
    with pytest.raises(DataError, match=r"need matplotlib.*pip install .*matplotlib"):
        CHANGE.colormap()


# Pictures, films and scenes.


def sides(sign=1):
    """A sheet that conducts less on its left and more on its right."""
    pytest.importorskip("matplotlib")
    mesh = disc(8, 300)
    return mesh, Panel("", sign * np.sign(mesh.centroids[:, 0]), ())


def test_a_picture_shows_a_fall_in_blue_and_a_rise_in_red(tmp_path):
    mesh, panel = sides()
    write_picture(tmp_path / "sheet.png", mesh, [panel], "S")
    assert blue_beside_red(Pillow.open(tmp_path / "sheet.png").convert("RGB"))


def test_a_film_shows_a_fall_in_blue_and_a_rise_in_red(tmp_path):
    """In each of its pictures, the sheet turned round in the second."""
    path = tmp_path / "sheet.gif"
    pictures = [rendered(path, *sides(sign), "S", 1.0) for sign in (1, -1)]
    FILMS[".gif"](path, pictures, 10.0)
    with Pillow.open(path) as film:
        film.seek(0)
        assert blue_beside_red(film.convert("RGB"))
        film.seek(1)
        assert not blue_beside_red(film.convert("RGB"))


@pytest.mark.parametrize(("kind", "end"), [("decrease", 0), ("increase", -1)])
def test_a_touch_in_foxglove_has_the_colour_of_its_sign(kind, end):
    touch = type(TOUCH)(1, kind, 0.0, TOUCH.detection)
    (entity,) = scene_message(Contact.each([touch], Plane()), 0)["entities"]
    (sphere,) = entity["spheres"]
    levels = [255 * sphere["color"][channel] for channel in "rgb"]
    assert levels == pytest.approx(CHANGE.table[end])
