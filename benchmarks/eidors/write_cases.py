"""Cases for ``time_eidors.m``: meshes as MATLAB files, with our voltages and our times.

``python benchmarks/eidors/write_cases.py FOLDER`` writes one file for each number of triangles.
"""

from __future__ import annotations

import statistics
import sys
import time
import timeit
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.io import savemat

from tomoskin.model.forward import ForwardModel
from tomoskin.model.mesh import Disc, ElectrodeArc, Mesh, triangulate
from tomoskin.model.pattern import Pattern

SIZES = (3000, 12_000)
REPEATS = 9
IMPEDANCE, CURRENT = 0.01, 1.0  # Ω·m; A, as EIDORS' stimulation tables count


def disc(cells: int) -> Mesh:
    """Round sheet of 0.2 m with 16 electrodes of 20 mm."""
    outline = Disc(0.1)
    arcs = [ElectrodeArc.around(k * outline.length / 16, 0.02) for k in range(16)]
    return triangulate(outline, arcs, cells)


def case(mesh: Mesh) -> dict[str, NDArray[Any]]:
    """What EIDORS needs of the model, counted from 1, with our voltages V and times s."""
    pattern = Pattern.adjacent(16)
    model = ForwardModel(mesh, pattern, contact_impedance=IMPEDANCE, current=CURRENT)
    sigma = np.exp(0.3 * np.random.default_rng(1).standard_normal(len(mesh.cells)))
    forward = timed(lambda: model.solve(sigma))
    jacobian = timed(lambda: model.jacobian(sigma))
    return {
        "nodes": mesh.points,
        "elems": mesh.cells + 1,
        "electrode_nodes": _cell_array([np.unique(facets) + 1 for facets in mesh.electrodes]),
        "z_contact": np.full(16, IMPEDANCE),
        "drive": pattern.drive + 1,
        "measure": pattern.measure + 1,
        "sigma": sigma[:, None],
        "v_tomoskin": model.solve(sigma).voltages[:, None],
        "forward_s": np.array(forward),
        "jacobian_s": np.array(jacobian),
    }


def _cell_array(arrays: list[NDArray[Any]]) -> NDArray[Any]:
    """As MATLAB's cells: arrays of their own lengths."""
    cells = np.empty(len(arrays), object)
    for number, array in enumerate(arrays):  # at once, numpy would stack those of one length
        cells[number] = array
    return cells


def timed(work: Callable[[], object]) -> float:
    """Median seconds of processor time."""
    work()
    return statistics.median(timeit.repeat(work, timer=time.process_time, repeat=REPEATS, number=1))


def main(folder: Path, sizes: tuple[int, ...] = SIZES) -> list[Path]:
    """Write the files; their paths."""
    folder.mkdir(parents=True, exist_ok=True)
    files = [folder / f"disc16_{cells}.mat" for cells in sizes]
    for file, cells in zip(files, sizes, strict=True):
        savemat(file, case(disc(cells)))
    return files


if __name__ == "__main__":
    for written in main(Path(sys.argv[1] if len(sys.argv) > 1 else "cases")):
        print(written)
