"""Touches in session files and tables: what cannot be told apart is said there too."""

from __future__ import annotations

import csv
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tomoskin.core import Amount, Detection, Touch
from tomoskin.files.exports import write_touches
from tomoskin.files.session import SessionReader, SessionWriter, session_info
from tomoskin.model.mesh import Cylinder, Plane
from tomoskin.model.skin import Skin

READING = Detection(
    *(0.01, -0.02, 0.001, 0.002, 3e-4, -0.1, np.array([4])), cov_xy=1e-6, close=True
)
TOUCHES = (
    Touch(1, "decrease", 0.5, replace(READING, close=False), (1, 3)),
    Touch(2, "decrease", 0.5, READING),
    Touch(4, "increase", 0.5, replace(READING, close=False, force=Amount(4.0, 3.5, 4.75))),
)


@pytest.fixture
def session(tmp_path: Path) -> Path:
    path = tmp_path / "x.mcap"
    with SessionWriter(path, Skin.load("textile-disc-8")) as writer:
        writer.touches(1.0, 7, TOUCHES)
    return path


def test_touches_come_back_as_they_were(session: Path) -> None:
    with SessionReader(session) as reader:
        (item,) = reader.touches()
    for got, put in zip(item.touches, TOUCHES, strict=True):
        assert (got.id, got.kind, got.since, got.merged) == (
            put.id,
            put.kind,
            put.since,
            put.merged,
        )
        assert (got.detection.cov_xy, got.detection.close) == (
            put.detection.cov_xy,
            put.detection.close,
        )
        assert got.detection.force == put.detection.force


def test_a_touch_that_was_only_seen_merged_counts(session: Path) -> None:
    assert session_info(session).touches == 4


def test_the_table_says_what_is_too_close(tmp_path: Path) -> None:
    write_touches(tmp_path / "x.csv", [(0, 0.0, TOUCHES)])
    rows = (tmp_path / "x.csv").read_text().splitlines()
    assert rows[0].split(",")[-1] == "kind"
    assert [row.split(",")[-1] for row in rows[1:]] == ["merged 1+3", "too close", "increase"]


def test_on_a_surface_the_table_says_where_in_space(tmp_path: Path) -> None:
    around = Cylinder(35e-3)
    write_touches(tmp_path / "x.csv", [(0, 0.0, TOUCHES)], around)
    with (tmp_path / "x.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    place = np.array([[float(row[f"space_{c}_m"]) for c in "xyz"] for row in rows])
    sheet = np.array([[float(row["x_m"]), float(row["y_m"])] for row in rows])
    assert place == pytest.approx(around.point(sheet), abs=1e-6)
    assert np.hypot(place[:, 0], place[:, 2] + 35e-3) == pytest.approx(35e-3, rel=1e-4)
    write_touches(tmp_path / "flat.csv", [(0, 0.0, TOUCHES)], Plane())
    assert "space" not in (tmp_path / "flat.csv").read_text()


def test_forces_stand_in_columns_of_their_own(tmp_path: Path) -> None:
    path = tmp_path / "x.csv"
    weighed = replace(READING, force=Amount(4.0, 3.5, 4.6))
    deep = replace(READING, depth=Amount(0.5e-3, 0.25e-3, math.inf))
    touches = tuple(Touch(k, "decrease", 0.5, d) for k, d in enumerate((weighed, deep, READING)))
    write_touches(path, [(3, 0.5, touches)], measured=("force", "depth"))
    with path.open(newline="") as file:
        rows = [
            [row[key] for key in row if key.startswith(("force", "depth"))]
            for row in csv.DictReader(file)
        ]
    assert rows == [
        ["4", "3.5", "4.6", "calibrated", "", "", "", ""],
        ["", "", "", "", "0.0005", "0.00025", "inf", "calibrated"],
        [""] * 8,
    ]
    write_touches(path, [(3, 0.5, touches)], overwrite=True)
    assert "force" not in path.read_text()
