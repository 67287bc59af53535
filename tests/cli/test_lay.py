"""``tomoskin skin lay``."""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np
import pytest

from shapes import disc
from tomoskin.model.skin import Skin


@pytest.fixture
def surface(tmp_path: Path) -> Path:
    mesh = disc(cells=300)
    flat = np.pad(1e3 * mesh.points, ((0, 0), (0, 1)))
    meshio.write(tmp_path / "sheet.stl", meshio.Mesh(flat, [("triangle", mesh.cells)]))
    turn = 2 * np.pi * np.arange(8) / 8
    rows = [f"{100 * np.cos(a):.3f},{100 * np.sin(a):.3f},0" for a in turn]
    (tmp_path / "places.csv").write_text("\n".join(["x,y,z", *rows]))
    return tmp_path


def arguments(folder: Path, **changes: str) -> list[str]:
    options = {"electrodes": str(folder / "places.csv"), "out": str(folder / "s.toml")} | changes
    flags = [part for name, value in options.items() for part in (f"--{name}", value)]
    return ["skin", "lay", str(folder / "sheet.stl"), *flags]


def test_it_writes_a_skin_file(tomoskin, surface: Path) -> None:
    code, out, _ = tomoskin(*arguments(surface))
    assert code == 0
    assert "8 electrodes on 31" in out
    assert Skin.load(surface / "s.toml").n_electrodes == 8


@pytest.mark.parametrize(
    ("changes", "places", "words"),
    [
        ({"unit": "inch"}, None, "--unit: expected mm or cm or m"),
        ({"unit": "m"}, None, "millimetres"),
        ({}, "1,2\n", "places.csv, line 1: expected three numbers"),
        ({}, "1;2;3\n", "line 1: expected three numbers"),
        ({}, "\n", "is an empty file"),
        ({}, "-50,0,0\n50,0,0\n0,50,0\n0,0,99\n", "E4: is 99 mm away from the surface"),
        ({}, "-50,0,0\n50,0,0\n0,50,0\n", "expected at least 4 electrodes, got 3"),
        (
            {},
            "-.1,0,0\n.1,0,0\n0,.1,0\n0,-.1,0\n",
            "lie within 0.2 mm, but the surface extends over 200",
        ),
    ],
)
def test_what_is_wrong_is_said(
    tomoskin, surface: Path, changes: dict[str, str], places: str | None, words: str
) -> None:
    if places is not None:
        (surface / "places.csv").write_text(places)
    code, _, error = tomoskin(*arguments(surface, **changes))
    assert code == 1
    assert words in error
    assert not (surface / "s.toml").exists()


def test_metres_taken_for_millimetres_are_noticed(tomoskin, surface: Path) -> None:
    mesh = disc(cells=300)
    small = meshio.Mesh(np.pad(mesh.points, ((0, 0), (0, 1))), [("triangle", mesh.cells)])
    meshio.write(surface / "sheet.stl", small)
    code, _, error = tomoskin(*arguments(surface))
    assert code == 1
    assert "extends over 0.2 mm, read in mm (if the file is in metres, say so: --unit m)" in error


def test_it_overwrites_nothing(tomoskin, surface: Path) -> None:
    (surface / "s.toml").write_text("mine")
    code, _, error = tomoskin(*arguments(surface))
    assert (code, (surface / "s.toml").read_text()) == (2, "mine")
    assert "exists" in error
