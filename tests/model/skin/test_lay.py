"""Skins on surfaces from files."""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np
import pytest

from shapes import disc
from tomoskin.core import FloatArray, GeometryError, SkinError
from tomoskin.model.forward import ForwardModel
from tomoskin.model.mesh import Cap
from tomoskin.model.skin import Skin, lay
from tomoskin.model.skin.lay import fewer_corners

CAP = Cap(0.1)
LIKE = Skin.load("textile-disc-8").altered({"mesh": {"cells": 400}})


def electrodes() -> FloatArray:
    turn = np.pi / 2 - 2 * np.pi * np.arange(8) / 8
    return 1e3 * CAP.point(0.1 * np.column_stack([np.cos(turn), np.sin(turn)]))


@pytest.fixture
def file(tmp_path: Path) -> Path:
    mesh = disc(cells=1200)
    path = tmp_path / "cap.stl"
    meshio.write(path, meshio.Mesh(1e3 * CAP.point(mesh.points), [("triangle", mesh.cells)]))
    return path


def voltages(skin: Skin) -> FloatArray:
    model = ForwardModel(skin.mesh(), skin.pattern(), skin.contact_impedance, skin.current)
    return model.solve(skin.conductivity).voltages


def test_it_measures_as_the_surface_that_the_file_was_drawn_from(file: Path) -> None:
    skin = lay(file, electrodes(), like=LIKE)
    drawn = LIKE.altered({"surface": {"shape": "cap", "radius": "100 mm"}})
    assert voltages(skin) == pytest.approx(voltages(drawn), rel=0.04)
    assert skin.mesh().volumes.sum() == pytest.approx(drawn.mesh().volumes.sum(), rel=0.01)


def test_the_skin_file_finds_its_surface_beside_it(file: Path, tmp_path: Path) -> None:
    folder = tmp_path / "skins"
    folder.mkdir()
    path = folder / "cap.toml"
    skin = lay(file, electrodes(), like=LIKE, source=str(path))
    path.write_text(skin.to_toml())
    assert 'file = "../cap.stl"' in skin.to_toml()
    assert Skin.load(path).mesh().identity == skin.mesh().identity


def test_electrodes_are_where_they_were_put(file: Path) -> None:
    skin = lay(file, electrodes(), like=LIKE)
    found = 1e3 * skin.surface.point(skin.electrode_centres)
    assert np.linalg.norm(found - electrodes(), axis=1).max() < 1.5


def test_an_electrode_off_the_surface_or_its_rim_is_named(file: Path) -> None:
    places = electrodes()
    places[3] += 30
    with pytest.raises(GeometryError, match=r"E4: is .* mm away from the surface"):
        lay(file, places, like=LIKE)
    places[3] = 0
    with pytest.raises(SkinError, match=r"E4: expected a position on the rim"):
        lay(file, places, like=LIKE)


def test_millimetres_taken_for_metres_are_detected(file: Path) -> None:
    with pytest.raises(GeometryError, match=r"extends over .* m \(if the file is in millimetres"):
        lay(file, electrodes(), unit="m", like=LIKE)


def test_a_file_that_went_away_is_named(file: Path, tmp_path: Path) -> None:
    path = tmp_path / "cap.toml"
    path.write_text(lay(file, electrodes(), like=LIKE, source=str(path)).to_toml())
    file.unlink()
    with pytest.raises(SkinError, match=r"cap.toml: \[surface\], .*cap.stl: there is no such file"):
        Skin.load(path)


def test_a_line_keeps_the_corners_that_it_needs() -> None:
    square = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], dtype=float)
    fine = np.concatenate(
        [
            a + np.linspace(0, 1, 10, endpoint=False)[:, None] * (b - a)
            for a, b in zip(square, np.roll(square, -1, axis=0), strict=True)
        ]
    )
    assert fewer_corners(fine).tolist() == square.tolist()
