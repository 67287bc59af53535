"""The notebook's cells, run one after the other as Jupyter would, without Jupyter."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

NOTEBOOK = Path(__file__).resolve().parents[2] / "examples" / "first_steps.ipynb"


def test_the_notebook_runs_and_finds_the_finger(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plt = pytest.importorskip("matplotlib.pyplot")
    monkeypatch.chdir(tmp_path)
    plt.switch_backend("agg")
    cells = json.loads(NOTEBOOK.read_text(encoding="utf-8"))["cells"]
    names: dict[str, Any] = {}
    for number, cell in enumerate(cells):
        if cell["cell_type"] == "code":
            assert cell["outputs"] == [], "clear the outputs: they are large and would grow stale"
            exec(compile("".join(cell["source"]), f"cell {number}", "exec"), names)
    assert len(plt.get_fignums()) == 4
    plt.close("all")
    assert names["d"].x == pytest.approx(0.03, abs=0.005)
    assert names["d"].y == pytest.approx(0.02, abs=0.005)
    assert names["x"][0] < -15
    assert names["x"][-1] > 15
