"""Forward engine: solves, Jacobians, set-up and local update against pyEIT and plain scipy.

``python benchmarks/forward.py FOLDER`` writes the cases that ``eidors/time_eidors.m`` times.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from importlib import import_module
from importlib.util import find_spec
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import savemat

import forward_others as others
from forward_others import Script, peer_name
from report import Report, cell, clock, medians, table
from tomoskin.core import FloatArray, IntArray
from tomoskin.imaging import OneStep
from tomoskin.model.forward import ForwardModel, State
from tomoskin.model.mesh import Disc, ElectrodeArc, Mesh, extrude, ring, triangulate
from tomoskin.model.pattern import Pattern

ELECTRODES, RADIUS = 16, 0.1
CONTACT = {2: 1e-3, 3: 1e-4}
"""Contact impedance, Ω·m on a sheet and Ω·m² on a volume."""

PATTERN = Pattern.adjacent(ELECTRODES)
ALPHA, AGREE, SECONDS = 1e-3, 1e-9, 4.0
TOUCH, MANY = 150, 64
MOST_SET_UP = 300_000
"""Cells; the operator of more would not fit the memory of many a machine."""

_STATUS = Path("/proc/self/status")


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
    patches = ring(Disc(RADIUS), ELECTRODES, 0.02, 0.04, 0.06)
    mesh = extrude(Disc(RADIUS), RADIUS, patches, cells=cells, layers=layers)
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


@dataclass(frozen=True, eq=False)
class Measured:
    """Times in s and peaks in MB by name; what was not measured is missing."""

    case: Case
    unknowns: int
    times: dict[str, float]
    peak: dict[str, float] = field(default_factory=dict)

    def ratio(self, name: str, own: str) -> float | None:
        """Time of ``name`` in parts of that of ``own``."""
        found, base = self.times.get(name), self.times.get(own)
        return None if found is None or base is None else found / base


def measure(case: Case, *, script: bool = True, peer: str = "") -> Measured:
    """Time everything of ``case``; ``peer``: which letters of f(orward), j(acobian), s(et-up)."""
    model = ForwardModel(case.mesh, PATTERN, case.contact_impedance)
    sigma = 1.0 + 0.1 * np.random.default_rng(1).random(len(case.mesh.cells))
    state = model.at(sigma)
    assert state.residual < AGREE
    times = _against_library(model, sigma)
    if script:
        times |= _against_script(model, sigma)
    if len(case.mesh.cells) <= MOST_SET_UP:
        times |= medians({"set-up": lambda: set_up(case)}, SECONDS / 2)
    times |= medians({"model": lambda: _model(case)}, SECONDS / 2)
    if others.INSTALLED:
        calls = others.Peer(model.mesh, model.pattern).calls(sigma, ALPHA)
        chosen = {name: call for name, call in calls.items() if name.split()[1][0] in peer}
        times |= medians(chosen, SECONDS) if chosen else {}
    return Measured(case, model.assembly.n_unknowns, times, peaks(case))


def _against_library(model: ForwardModel, sigma: FloatArray) -> dict[str, float]:
    """Own calls; factor and solve alone, by faer and by us; copies of the Jacobian's size."""
    state = model.at(sigma)
    result = state.jacobian
    target = result.copy()  # memory in use
    calls = {
        "forward": lambda: model.solve(sigma),
        **_factor_and_solve(state),
        "jacobian": lambda: model.jacobian(sigma),
        "rows": lambda: _rows(state),
        "copy": lambda: np.copyto(target, result),
        "new copy": lambda: np.array(result),
    }
    return medians(calls, SECONDS, least=3)


def _factor_and_solve(state: State) -> dict[str, Callable[[], object]]:
    """Calls that factorise and solve on ready arrays, and do nothing else.

    ``own`` by our engine; ``faer``, where the native engine was built with it (`make claims`),
    by that library as it comes: minimum degree, panels or not as it finds better, all of it
    analysed beforehand.
    """
    model, matrix = state.model, state.model.assembly.matrix
    ready = matrix(state.conductivity, model.contacts)
    n, n_points = model.assembly.n_unknowns, model.assembly.n_points
    electrodes = np.arange(n_points, n)
    calls = {"own": lambda: model.factorise(ready.values).columns(electrodes)}
    reference = _reference()
    if reference is None:
        return calls
    faer = reference(n, ready.indptr, ready.indices, n - n_points)
    columns = np.eye(n - n_points, n, n_points)
    _agree(faer.solve(ready.values, columns).T, state.basis, "faer")
    return {**calls, "faer": lambda: faer.solve(ready.values, columns)}


def _reference() -> Any:
    """The class of bare faer, where the native engine was built with it."""
    if find_spec("tomoskin_core") is None:
        return None
    return getattr(import_module("tomoskin_core"), "Reference", None)


def _rows(state: State) -> FloatArray:
    """Return the Jacobian of a state whose fields are solved already."""
    for name in ("gradient", "jacobian"):
        state.__dict__.pop(name, None)
    return state.jacobian


def _against_script(model: ForwardModel, sigma: FloatArray) -> dict[str, float]:
    script = Script(model.mesh, model.pattern, float(model.contact_impedance[0]))
    _agree(script.voltages(sigma), model.solve(sigma).voltages, "the script")
    _agree(script.jacobian(sigma), model.jacobian(sigma), "the script")
    return medians(
        {
            "forward, script run": lambda: model.solve(sigma),
            "jacobian, script run": lambda: model.jacobian(sigma),
            "script forward": lambda: script.voltages(sigma),
            "script jacobian": lambda: script.jacobian(sigma),
        },
        SECONDS,
    )


def _agree(other: FloatArray, own: FloatArray, whose: str) -> None:
    off = np.abs(other - own).max() / np.abs(own).max()
    if not off < AGREE:
        raise AssertionError(f"{whose}: off by {off:.1e}")


def _model(case: Case) -> object:
    """From a checked mesh to a model with its maps and its analysis."""
    model = ForwardModel(case.mesh, PATTERN, case.contact_impedance)
    return model.assembly.stiffness, model.contacts, model.factorise


def set_up(case: Case) -> OneStep:
    """From points and cells to the one-step operator."""
    mesh = Mesh(case.mesh.points, case.mesh.cells, case.mesh.electrodes)
    return OneStep(ForwardModel(mesh, PATTERN, case.contact_impedance), alpha=ALPHA)


def measure_touch(case: Case) -> Measured:
    """Time local updates, their columns in hand, one and many, and what they save."""
    model = ForwardModel(case.mesh, PATTERN, case.contact_impedance)
    base = np.ones(len(case.mesh.cells))
    touches = _touches(case)
    cells, changed = touches[0]
    own = base.copy()
    own[cells] = changed
    local = model.at(base).local
    _agree(local.voltages_of(touches)[0], model.solve(own).voltages, "local update")
    script = Script(case.mesh, PATTERN, case.contact_impedance)
    calls = {
        "update": lambda: local.voltages(cells, changed),
        "many": lambda: local.voltages_of(touches),
        **_factor_and_solve(model.at(own)),
        "forward": lambda: model.solve(own),
        "script forward": lambda: script.voltages(own),
    }
    times = medians(calls, SECONDS, least=3)
    times["many"] /= len(touches)
    return Measured(case, model.assembly.n_unknowns, times)


def _touches(case: Case) -> list[tuple[IntArray, FloatArray]]:
    """MANY touches of TOUCH cells, the first off the middle, the others anywhere."""
    rng = np.random.default_rng(2)
    radius, angle = 0.07 * np.sqrt(rng.random(MANY)), rng.uniform(0, 2 * np.pi, MANY)
    places = np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])
    places[0] = 0.03, 0.02
    gaps = (np.linalg.norm(case.mesh.centroids - place, axis=1) for place in places)
    return [(np.argsort(gap)[:TOUCH], np.full(TOUCH, 0.8)) for gap in gaps]


def peaks(case: Case) -> dict[str, float]:
    """MB above a fresh process with its mesh: after ``forward``, after ``jacobian`` too."""
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        return pool.submit(_peaks, case).result() if _STATUS.exists() else {}


def _peaks(case: Case) -> dict[str, float]:
    Path("/proc/self/clear_refs").write_text("5", encoding="ascii")  # the check of the mesh
    base = _kilobytes("VmRSS")
    state = ForwardModel(case.mesh, PATTERN, case.contact_impedance).at(1.0)
    assert state.residual < 1e-6
    forward = _kilobytes("VmHWM")
    assert np.isfinite(state.jacobian[:, 0]).all()
    return {"forward": (forward - base) / 1e3, "jacobian": (_kilobytes("VmHWM") - base) / 1e3}


def _kilobytes(name: str) -> float:
    lines = _STATUS.read_text(encoding="ascii").splitlines()
    return float(next(line for line in lines if line.startswith(name)).split()[1])


def run() -> Iterator[Report]:
    touched, fine = disc("3k", 3000), disc("50k", 50_000)
    touch = measure_touch(touched)
    measured = [
        measure(disc("660", 660), peer="fjs"),
        measure(touched, peer="fjs"),
        measure(disc("12k", 12_000), peer="fjs"),
        measure(fine, peer="f"),
        measure(Case("200k", refined(fine.mesh))),
        measure(tank("10k tetrahedra", 400, 8), peer="f"),
        measure(tank("60k tetrahedra", 1600, 12)),
    ]
    yield from _tables(measured)
    yield _touch_table(touch)


def run_large() -> Iterator[Report]:
    """Forward engine on a quarter of a million triangles and a million: minutes."""
    quarter = refined(disc("62k", 62_500).mesh)
    cases = Case("250k", quarter), Case("1M", refined(quarter))
    yield from _tables([measure(case, script=False) for case in cases])


def _tables(measured: Sequence[Measured]) -> Iterator[Report]:
    """Solves, Jacobians and set-up of every case."""
    yield table(
        f"forward: {ELECTRODES} electrodes, adjacent, all drives",
        map(_forward, measured),
        f"medians of {clock()[1]}; × is how many times longer the other takes",
        "faer: factor and solve of the same matrix by that library as it comes, its analysis made "
        "before; own: the same by our engine; script: COO assembly, splu as it comes",
        f"{peer_name()}: point electrodes; larger meshes are left out; all others agree to 1e-9",
        "peak: resident memory above that of the process with its mesh, in its own process",
    )
    yield table(
        "Jacobian with its solves",
        map(_jacobian, measured),
        "after solves: gradients and rows, written to new memory",
        "new copy: an array of the result's size, to new memory too; copy: into one in use",
    )
    yield table(
        "set-up: points and cells → one-step operator (NOSER)",
        map(_set_up, measured),
        "model: structure, maps and analysis alone, from a checked mesh",
        "check of the mesh included in the rest; pyEIT: JAC with p = 0.5",
    )


def _ms(measured: Measured, name: str) -> str:
    seconds = measured.times.get(name)
    return cell(None if seconds is None else 1e3 * seconds)


def _size(measured: Measured) -> str:
    kind = "triangles" if measured.case.mesh.dimension == 2 else "tetrahedra"
    return f"{len(measured.case.mesh.cells):,} {kind}"


def _forward(m: Measured) -> dict[str, Any]:
    return {
        "cells": _size(m),
        "unknowns": f"{m.unknowns:,}",
        "ms": _ms(m, "forward"),
        "ms/faer": cell(m.ratio("forward", "faer")),
        "ms/own": cell(m.ratio("forward", "own")),
        "script ×": cell(m.ratio("script forward", "forward, script run")),
        "pyEIT ×": cell(m.ratio("peer forward", "forward")),
        "peak MB": cell(m.peak.get("forward")),
    }


def _jacobian(m: Measured) -> dict[str, Any]:
    return {
        "cells": _size(m),
        "ms": _ms(m, "jacobian"),
        "script ×": cell(m.ratio("script jacobian", "jacobian, script run")),
        "pyEIT ×": cell(m.ratio("peer jacobian", "jacobian")),
        "after solves ms": _ms(m, "rows"),
        "ms/copy": cell(m.ratio("rows", "copy")),
        "ms/new copy": cell(m.ratio("rows", "new copy")),
        "peak MB": cell(m.peak.get("jacobian")),
    }


def _set_up(m: Measured) -> dict[str, Any]:
    return {
        "cells": _size(m),
        "model ms": _ms(m, "model"),
        "ms": _ms(m, "set-up"),
        "pyEIT ×": cell(m.ratio("peer set-up", "set-up")),
    }


def _touch_table(m: Measured) -> Report:
    """Local updates against fresh solves."""
    fresh = {"faer": "faer", "own": "own", "forward": "forward", "script": "script forward"}
    rows = (
        {"cells": _size(m), "touches": what, "ms": _ms(m, own)}
        | {f"{name} ×": cell(m.ratio(other, own)) for name, other in fresh.items()}
        for what, own in (("one", "update"), (f"each of {MANY}", "many"))
    )
    return table(
        f"local update: touches of {TOUCH} cells, columns in hand",
        rows,
        "× is how many times longer a fresh one takes",
        "faer and own: factor and solve alone, as in the table of forward solves",
    )


EIDORS_SIZES, EIDORS_SECONDS = (3000, 12_000), 2.0
"""Triangles of the cases for ``eidors/time_eidors.m``."""


def eidors_case(case: Case) -> dict[str, Any]:
    """What EIDORS needs of the model, counted from 1, with our voltages V and times s."""
    mesh = case.mesh
    model = ForwardModel(mesh, PATTERN, case.contact_impedance)
    sigma = np.exp(0.3 * np.random.default_rng(1).standard_normal(len(mesh.cells)))
    calls = {"forward": lambda: model.solve(sigma), "jacobian": lambda: model.jacobian(sigma)}
    times = medians(calls, EIDORS_SECONDS, least=9)
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


def main(folder: Path, sizes: tuple[int, ...] = EIDORS_SIZES) -> list[Path]:
    """Write the cases as MATLAB files, with our voltages and times; their paths."""
    folder.mkdir(parents=True, exist_ok=True)
    files = [folder / f"disc16_{cells}.mat" for cells in sizes]
    for file, cells in zip(files, sizes, strict=True):
        savemat(file, eidors_case(disc(file.stem, cells)))
    return files


if __name__ == "__main__":
    for written in main(Path(sys.argv[1] if len(sys.argv) > 1 else "cases")):
        print(written)
