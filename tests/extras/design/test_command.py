"""``tomoskin design``."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from tomoskin.core import DataError
from tomoskin.extras.design import command as design

Run = Callable[..., tuple[int, str, str]]


@pytest.fixture(autouse=True)
def coarse(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(design, "_PLACES", 30)
    monkeypatch.setattr(design, "_COARSE", 30)


def test_a_map_and_a_comparison(tomoskin: Run, tmp_path: Path) -> None:
    picture = tmp_path / "map.png"
    code, out, err = tomoskin(
        "design", "--out", picture, "--electrodes", "8", "--patterns", "adjacent,skip:3"
    )
    assert (code, err) == (0, "")
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert "textile-disc-8: a press of radius 15 mm" in out
    assert "the same sheet with another design" in out
    assert "8 electrodes, skip:3: " in out


def test_designs_that_saturate_are_marked_in_the_table_and_explained_once(tomoskin: Run) -> None:
    asked = ("design", "--electrodes", "16", "--patterns", "adjacent,opposite,skip:2,skip:3")
    code, out, err = tomoskin(*asked)
    assert (code, err) == (0, "")
    marked = [line for line in out.splitlines() if line.endswith("yes")]
    rows = json.loads(tomoskin(*asked, "--json")[1])["compared"]
    assert len(marked) == sum("saturated" in row for row in rows) > 1
    assert out.count("saturate") == 2, "in the heading, and in one sentence"


def test_without_matplotlib_it_says_so_before_the_work(
    tomoskin: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def work(*_: object) -> None:
        raise AssertionError("the work has begun")

    monkeypatch.setitem(sys.modules, "matplotlib", None)
    monkeypatch.setattr("tomoskin.extras.design.bounds.resolution_bounds", work)
    code, out, err = tomoskin("design", "--out", tmp_path / "map.png", "--electrodes", "")
    assert (code, out) == (1, "")
    assert "needs matplotlib to write it, which is not installed" in err
    assert f"{sys.executable} -m pip install" in err


def test_a_map_that_cannot_be_written_does_not_cost_the_table(
    tomoskin: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object, **__: object) -> None:
        raise DataError("cannot be written: No space left on device")

    monkeypatch.setattr("tomoskin.extras.design.design_map.write_promise", full)
    code, out, err = tomoskin("design", "--out", tmp_path / "map.png", "--electrodes", "")
    assert code == 1
    assert "No space left" in err
    assert "the RMS error of its position is at least" in out


def test_for_programs(tomoskin: Run) -> None:
    options = ("--electrodes", "8,16", "--patterns", "adjacent", "--radius", "20 mm", "--json")
    code, out, err = tomoskin("design", *options)
    assert (code, err) == (0, "")
    found = json.loads(out)
    assert found["press"] == {"radius_m": 0.02, "depth": 0.25}
    eight, sixteen = found["compared"]
    assert (eight["rows"], sixteen["rows"]) == (40, 208)
    assert sixteen["median_m"] < eight["median_m"]
    assert eight["median_m"] == pytest.approx(found["median_m"], rel=0.2)


def test_wrong_options_are_said(tomoskin: Run, tmp_path: Path) -> None:
    assert tomoskin("design", "--electrodes", "many")[0] == 2
    assert tomoskin("design", "--radius", "15 kg", "--electrodes", "")[0] == 2
    code, _, err = tomoskin("design", "--radius", "9 m", "--electrodes", "")
    assert code == 1
    assert "expected a radius below 100 mm" in err
    code, _, err = tomoskin("design", "--depth", "2", "--electrodes", "")
    assert code == 1
    assert "depth between 0 and 1" in err
    folder = tmp_path / "none" / "map.png"
    code, _, err = tomoskin("design", "--out", folder, "--electrodes", "")
    assert code == 2
    assert "cannot be written" in err


def test_a_map_of_no_known_kind_is_refused_before_the_work(
    tomoskin: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(design, "_compared", lambda *_: pytest.fail("it has begun"))
    code, _, err = tomoskin("design", "--out", "map.xyz")
    assert code == 2
    assert "ends in .png (a picture), .pdf (a figure), .svg (a drawing), got map.xyz" in err
