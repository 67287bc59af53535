"""The section [surface]: what a sheet lies on."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tomoskin.core import SkinError
from tomoskin.model.mesh import Arm, Cap, Cylinder, Plane, Saddle
from tomoskin.model.skin import Skin


def skin(**surface: Any) -> Skin:
    return Skin.load("textile-disc-8").altered({"surface": surface, "mesh": {"cells": 300}})


@pytest.mark.parametrize(
    ("surface", "expected"),
    [
        ({}, Plane()),
        ({"shape": "cylinder", "radius": "70 mm"}, Cylinder(0.07)),
        ({"shape": "cylinder", "radius": "70 mm", "axis": "0 deg"}, Cylinder(0.07, 0.0)),
        ({"shape": "cap", "radius": "120 mm"}, Cap(0.12)),
        ({"shape": "saddle", "radius_x": "200 mm", "radius_y": "300 mm"}, Saddle(0.2, 0.3)),
        (
            {"shape": "arm", "radius": "40 mm", "bend": "30 deg", "joint": "60 mm"},
            Arm(0.04, np.radians(30), 0.06),
        ),
    ],
)
def test_what_it_lies_on(surface: dict[str, Any], expected: object) -> None:
    assert skin(**surface).surface == expected


def test_on_a_cylinder_it_is_the_same_mesh_but_another_skin() -> None:
    flat, round_ = skin(), skin(shape="cylinder", radius="70 mm")
    assert round_.mesh().identity == flat.mesh().identity
    assert round_.identity != flat.identity


def test_on_a_cap_its_mesh_has_the_cap_s_area() -> None:
    mesh = skin(shape="cap", radius="120 mm").mesh()
    sphere = 2 * np.pi * 0.12**2 * (1 - np.cos(0.1 / 0.12))
    assert mesh.volumes.sum() == pytest.approx(sphere, rel=0.01)
    assert np.abs(mesh.points).max() == pytest.approx(0.1)


def test_a_surface_survives_the_file() -> None:
    bent = skin(shape="arm", radius="40 mm", bend="30 deg", joint="60 mm")
    assert Skin.from_toml(bent.to_toml()).surface == bent.surface


@pytest.mark.parametrize(
    ("surface", "words"),
    [
        ({"shape": "cylinder", "radius": "20 mm"}, r"\[surface\]: .* overlaps itself"),
        (
            {"shape": "cylinder", "radius": "60 mm", "layer": "60 mm"},
            r"\[surface\]: expected a layer thinner than the radius, 60 mm, .* got 60 mm",
        ),
        ({"shape": "cap", "radius": "30 mm"}, r"\[surface\]: .* is covered at"),
        ({"shape": "cap"}, r"\[surface\] radius: is missing"),
        ({"radius": "70 mm"}, r"\[surface\] radius: needs shape"),
        ({"shape": "globe"}, r'\[surface\] shape: expected "flat" or'),
        (
            {"shape": "arm", "radius": "40 mm", "bend": "120 deg", "joint": "60 mm"},
            r"\[surface\]: .* folds .*less than",
        ),
    ],
)
def test_what_cannot_be_is_refused(surface: dict[str, Any], words: str) -> None:
    with pytest.raises(SkinError, match=words):
        skin(**surface)
