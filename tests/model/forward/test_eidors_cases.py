"""What a reader's EIDORS is given: as complete as its script needs, and the same model."""

from __future__ import annotations

import re
import runpy
from pathlib import Path

import numpy as np
from scipy.io import loadmat

from tomoskin.model.forward import ForwardModel
from tomoskin.model.mesh import Mesh
from tomoskin.model.pattern import Pattern

BENCHMARKS = Path(__file__).resolve().parents[3] / "benchmarks"


def test_the_files_hold_what_the_script_reads_and_give_our_voltages_again(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(BENCHMARKS)
    written = runpy.run_path(str(BENCHMARKS / "forward.py"))["main"](tmp_path, (400,))
    case = loadmat(written[0])
    script = (BENCHMARKS / "eidors" / "time_eidors.m").read_text(encoding="utf-8")
    asked = set(re.findall(r"\bc\.(\w+)", script))
    assert asked <= set(case)
    nodes, cells = case["nodes"], case["elems"] - 1
    edges = np.sort(cells[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    unique, count = np.unique(edges, axis=0, return_counts=True)
    rim = unique[count == 1]
    # EIDORS' rule: a facet of the rim belongs to the electrode that holds all its nodes
    electrodes = [
        rim[np.isin(rim, e.ravel() - 1).all(axis=1)] for e in case["electrode_nodes"].ravel()
    ]
    pattern = Pattern.from_tables(case["drive"] - 1, case["measure"] - 1)
    model = ForwardModel(
        Mesh(nodes, cells, tuple(electrodes)), pattern, case["z_contact"].ravel(), 1.0
    )
    again = model.solve(case["sigma"].ravel()).voltages
    assert np.allclose(again, case["v_tomoskin"].ravel(), rtol=1e-9)
    assert case["forward_s"].item() > 0
