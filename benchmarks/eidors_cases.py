"""Cases for ``eidors/time_eidors.m``: meshes as MATLAB files, with our voltages and our times.

``python benchmarks/eidors_cases.py FOLDER`` writes one file for each number of triangles.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.io import savemat

from forward import ELECTRODES, PATTERN, Case, disc
from report import medians
from tomoskin.model.forward import ForwardModel

SIZES, SECONDS = (3000, 12_000), 2.0


def content(case: Case) -> dict[str, NDArray[Any]]:
    """What EIDORS needs of the model, counted from 1, with our voltages V and times s."""
    mesh = case.mesh
    model = ForwardModel(mesh, PATTERN, case.contact_impedance)
    sigma = np.exp(0.3 * np.random.default_rng(1).standard_normal(len(mesh.cells)))
    calls = {"forward": lambda: model.solve(sigma), "jacobian": lambda: model.jacobian(sigma)}
    times = medians(calls, SECONDS, least=9)
    nodes = np.empty(ELECTRODES, object)  # MATLAB's cells: arrays of their own lengths
    for number, facets in enumerate(mesh.electrodes):
        nodes[number] = np.unique(facets) + 1
    return {
        "nodes": mesh.points,
        "elems": mesh.cells + 1,
        "electrode_nodes": nodes,
        "z_contact": np.full(ELECTRODES, case.contact_impedance),
        "drive": PATTERN.drive + 1,
        "measure": PATTERN.measure + 1,
        "sigma": sigma[:, None],
        "v_tomoskin": model.solve(sigma).voltages[:, None],
        "forward_s": np.array(times["forward"]),
        "jacobian_s": np.array(times["jacobian"]),
    }


def main(folder: Path, sizes: tuple[int, ...] = SIZES) -> list[Path]:
    """Write the files; their paths."""
    folder.mkdir(parents=True, exist_ok=True)
    files = [folder / f"disc16_{cells}.mat" for cells in sizes]
    for file, cells in zip(files, sizes, strict=True):
        savemat(file, content(disc(file.stem, cells)))
    return files


if __name__ == "__main__":
    for written in main(Path(sys.argv[1] if len(sys.argv) > 1 else "cases")):
        print(written)
