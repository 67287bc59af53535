"""Figures of merit as curves and as a table."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

from tomoskin.core import DataError
from tomoskin.extras.greit import Merit
from tomoskin.extras.greit.merit_curves import write_merit, write_merit_table

LINE = np.linspace(0, 0.08, 5)
MERIT = Merit(LINE, 1 + LINE, -LINE, LINE, 3 * LINE, 0.1 + LINE, np.full(5, np.nan), 0.7)


def test_the_table_holds_every_number(tmp_path: Path) -> None:
    path = tmp_path / "merit.csv"
    write_merit_table(path, {"a": MERIT, "b": MERIT})
    with path.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["operator"] for row in rows] == 5 * ["a"] + 5 * ["b"]
    assert [float(row["distance_m"]) for row in rows[:5]] == pytest.approx(LINE)
    assert [float(row["position_error_m"]) for row in rows[:5]] == pytest.approx(-LINE)
    assert float(rows[0]["noise_figure"]) == 0.7


def test_a_picture(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    write_merit(tmp_path / "merit.png", {"a": MERIT, "b": MERIT})
    assert (tmp_path / "merit.png").read_bytes().startswith(b"\x89PNG")


def test_a_place_that_cannot_be_written(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="cannot be written"):
        write_merit_table(tmp_path / "no" / "x.csv", {"a": MERIT})
