"""Meshes kept on disk are those that were made."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tomoskin import Skin
from tomoskin.core import archive
from tomoskin.model.mesh import Disc, ElectrodeArc, Mesh, triangulate
from tomoskin.model.skin import kept_mesh as module
from tomoskin.model.skin.build import flat_mesh
from tomoskin.model.skin.kept_mesh import kept_mesh


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv(archive.VARIABLE, str(tmp_path))
    module._versions.cache_clear()
    return tmp_path


class Made:
    """Makes a mesh, and counts how often."""

    def __init__(self) -> None:
        self.times = 0

    def __call__(self) -> Mesh:
        self.times += 1
        return triangulate(Disc(0.1), [ElectrodeArc(0.1 * k, 0.1 * k + 0.02) for k in range(4)], 80)


def same(one: Mesh, other: Mesh) -> bool:
    pairs = zip((one.points, one.cells, *one.electrodes),
                (other.points, other.cells, *other.electrodes), strict=True)  # fmt: skip
    return one.identity == other.identity and all(np.array_equal(a, b) for a, b in pairs)


def test_a_mesh_is_made_once_and_read_to_the_bit() -> None:
    make = Made()
    first, again = kept_mesh("a disc", make), kept_mesh("a disc", make)
    assert make.times == 1
    assert same(first, again)
    assert same(first, make())


def test_another_wish_or_another_generator_makes_another_one(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    make = Made()
    kept_mesh("a disc", make)
    kept_mesh("a larger disc", make)
    assert make.times == 2
    monkeypatch.setattr(module, "_versions", lambda: b"of tomorrow")
    kept_mesh("a disc", make)
    assert make.times == 3


def test_each_key_that_changes_the_mesh_changes_what_is_kept(folder: Path) -> None:
    skin = Skin.load("textile-disc-8").altered({"mesh": {"cells": 150}})
    changes = (
        {"outline": {"diameter": "210 mm"}},
        {"electrodes": {"width": "14 mm"}},
        {"electrodes": {"order": "counter-clockwise"}},
        {"mesh": {"cells": 160}},
    )
    flat_mesh.cache_clear()
    meshes = {skin.mesh().identity} | {skin.altered(c).mesh().identity for c in changes}
    assert len(meshes) == len(list(folder.glob("mesh-*.npz"))) == 1 + len(changes)
