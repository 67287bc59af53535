"""Lines of the documentation that take data as given are run on some that were made for them."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tomoskin.core import FloatArray
from tomoskin.model.forward import ForwardModel
from tomoskin.model.pattern import Pattern, Scan
from tomoskin.model.skin import Skin
from tomoskin.twin import TwinSettings, TwinSkin

DOCS = Path(__file__).resolve().parent.parent / "docs"
PAGES = (
    *("bodies", "imaging", "interchange", "outputs", "simulate"),
    *("touch", "touch-fit", "twin", "channel-mapping"),
)
BLOCK = re.compile(r"^```python\n(.*?)^```", re.DOTALL | re.MULTILINE)
NOISE, DEPTH = 2e-5, 0.25


@pytest.fixture(scope="module")
def given() -> dict[str, Any]:
    """What the fragments take as given: presses on the textile disc, and what belongs to them."""
    skin = Skin.load("textile-disc-8")
    pattern = skin.pattern()
    model = ForwardModel(skin.mesh(), pattern, skin.contact_impedance, skin.current)
    state, rng = model.at(skin.conductivity), np.random.default_rng(5)
    v = state.voltages

    def pressed(places: FloatArray) -> FloatArray:
        near = [np.linalg.norm(model.mesh.centroids - place, axis=1) < 0.02 for place in places]
        sigma = (1 - DEPTH) * skin.conductivity
        touches = [(np.flatnonzero(n), np.full(n.sum(), sigma)) for n in near]
        changes = state.local.voltages_of(touches) - v
        return np.asarray(changes + rng.normal(0.0, NOISE, changes.shape))

    rubbed = pressed(rng.uniform(-0.06, 0.06, (160, 2)))
    xy, more_xy = rng.uniform(-0.055, 0.055, (2, 60, 2))
    labels = np.column_stack([xy[:, 0] > 0, xy[:, 1] > 0])
    today = pressed(more_xy)
    currents = np.array([np.cos(k * np.pi / 4 * np.arange(8) + 0.1 * k) for k in range(1, 5)])
    return {
        "n": 8, "currents": currents, "potentials": (currents @ state.transfer_resistance)[None],
        "Pattern": Pattern,
        "skin": skin, "pattern": pattern, "scan": Scan.of(pattern), "model": model, "np": np,
        "v": v, "voltages": v + pressed(xy[:1])[0], "noise": np.full(len(v), NOISE),
        "rubbed": rubbed, "dv": pressed(xy), "xy": xy, "more_dv": today[:10],
        "more_xy": more_xy[:10], "dv_today": today, "labels": labels,
        "flags": np.where(rng.random((60, 1)) < 0.3, more_xy > 0, np.nan),
        "sample_sd": NOISE, "places": xy[:2], "points": xy,
        "drive": pattern.drive, "measure": pattern.measure,
        "detections": (), "time": 0.1, "host_time": 0.1,
        "sheet": TwinSkin.of(Skin.load("textile-square-16"), TwinSettings.preset("ideal", seed=1)),
    }  # fmt: skip


@pytest.mark.parametrize("page", PAGES)
def test_what_a_page_takes_as_given_is_all_it_needs(
    page: str, given: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(DOCS.parent / "examples")
    run_blocks(page, given)


def run_blocks(page: str, given: dict[str, Any]) -> None:
    """Run what a page shows, one block after the other."""
    names = dict(given)
    blocks = BLOCK.findall((DOCS / f"{page}.md").read_text(encoding="utf-8"))
    assert blocks
    for block in blocks:
        exec(compile(block, f"{page}.md", "exec"), names)
