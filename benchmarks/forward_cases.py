"""Meshes of the forward benchmarks, and how their calls are timed."""

from __future__ import annotations

import gc
import os
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from tomoskin.core import IntArray
from tomoskin.model.mesh import Disc, ElectrodeArc, Mesh, cylinder, triangulate
from tomoskin.model.pattern import Pattern

ELECTRODES = 16
RADIUS = 0.1
CONTACT = {2: 1e-3, 3: 1e-4}
"""Contact impedance, Ω·m on a sheet and Ω·m² on a volume."""

PATTERN = Pattern.adjacent(ELECTRODES)
MOST_REPEATS = 200


@dataclass(frozen=True, eq=False)
class Case:
    """A mesh under the name of its size."""

    name: str
    mesh: Mesh

    @property
    def contact_impedance(self) -> float:
        """Ω·m or Ω·m²."""
        return CONTACT[self.mesh.dimension]


def disc(name: str, cells: int) -> Case:
    """Triangles from the mesher."""
    around = 2 * np.pi * RADIUS / ELECTRODES
    arcs = [ElectrodeArc.around(k * around, around / 2) for k in range(ELECTRODES)]
    return Case(name, triangulate(Disc(RADIUS), arcs, cells))


def tank(name: str, cells: int, layers: int) -> Case:
    """Tetrahedra of a cylinder with a ring of electrodes."""
    mesh = cylinder(
        RADIUS,
        RADIUS,
        count=ELECTRODES,
        width=0.02,
        bottom=0.04,
        top=0.06,
        cells=cells,
        layers=layers,
    )
    return Case(name, mesh)


def refined(mesh: Mesh) -> Mesh:
    """Four triangles for each, two edges for each of an electrode."""
    n, cells = len(mesh.points), mesh.cells
    ends = np.concatenate([cells[:, [0, 1]], cells[:, [1, 2]], cells[:, [2, 0]]])
    keys, place = np.unique(_keys(ends, n), return_inverse=True)
    ab, bc, ca = n + place.reshape(3, -1)
    a, b, c = cells.T
    parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    electrodes = []
    for facets in mesh.electrodes:
        middle = n + np.searchsorted(keys, _keys(facets, n))
        halves = [(facets[:, 0], middle), (middle, facets[:, 1])]
        electrodes.append(np.concatenate([np.column_stack(half) for half in halves]))
    middles = mesh.points[np.column_stack([keys // n, keys % n])].mean(axis=1)
    return Mesh(
        np.concatenate([mesh.points, middles]),
        np.concatenate([np.column_stack(part) for part in parts]),
        tuple(electrodes),
    )


def _keys(edges: IntArray, n: int) -> IntArray:
    low, high = np.sort(edges, axis=1).T
    return low * n + high


Clock = Callable[[], float]


def clock() -> tuple[Clock, str]:
    """Processor time where one core is used, since other programs do not add to it."""
    if len(os.sched_getaffinity(0)) == 1:
        return time.process_time, "processor time"
    return time.perf_counter, "wall time"


def medians(
    calls: Mapping[str, Callable[[], object]], seconds: float, *, least: int = 1
) -> dict[str, float]:
    """Median time of each call, s: turn about for ``seconds``, and ``least`` turns.

    A call runs a few times in a row in its turn, so that all find caches of their own making.
    """
    now, _ = clock()
    taken: dict[str, list[float]] = {name: [] for name in calls}
    gc.collect()
    gc.disable()
    began = now()
    turns = 0
    while turns < least or now() - began < seconds:
        turns += 1
        for name, call in calls.items():
            turn, most = 0.0, min(0.05, seconds / 10)
            while turn <= most and len(taken[name]) < MOST_REPEATS:
                start = now()
                call()
                taken[name].append(now() - start)
                turn += taken[name][-1]
        if all(len(times) >= MOST_REPEATS for times in taken.values()):
            break
    gc.enable()
    return {name: float(np.median(times)) for name, times in taken.items()}
