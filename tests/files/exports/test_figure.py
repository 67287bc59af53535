"""Pictures keep off their edge, however many panels they have."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from shapes import disc
from tomoskin.files.exports import Panel, write_choices, write_picture
from tomoskin.imaging import AlphaChoice, Curve

RIM = 8
"""Pixels that stay empty, of 120 an inch."""


def outside(path: Path) -> float:
    """Darkest value of the picture's rim, 1 where it is white."""
    image = pytest.importorskip("matplotlib.image").imread(path)[..., :3]
    inner = np.zeros(image.shape[:2], bool)
    inner[RIM:-RIM, RIM:-RIM] = True
    assert image[inner].min() < 0.5  # there is something in it
    return float(image[~inner].min())


@pytest.mark.parametrize("panels", [1, 5])
def test_nothing_touches_the_edge(tmp_path: Path, panels: int) -> None:
    mesh = disc(8, 200)
    sheet = [Panel(f"frame {i}", mesh.centroids[:, 0], ()) for i in range(panels)]
    write_picture(tmp_path / "sheet.png", mesh, sheet, "S")
    x = np.geomspace(1e-3, 1.0, 20)
    curve = Curve(x, 1.0 + np.log(x) ** 2, "error", 10)
    choices = [AlphaChoice(0.1, "light-touch", "for a test", curve) for _ in range(panels)]
    write_choices(tmp_path / "curves.png", "alpha of a test", choices)
    assert outside(tmp_path / "sheet.png") == 1.0
    assert outside(tmp_path / "curves.png") == 1.0
