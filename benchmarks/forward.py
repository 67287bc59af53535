"""Forward engine: solves, Jacobians, set-up and local update against pyEIT and plain scipy."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from forward_measure import (
    ELECTRODES,
    MANY,
    PATTERN,
    TOUCH,
    Case,
    Measured,
    disc,
    measure,
    measure_touch,
    refined,
    tank,
)
from forward_others import peer_name
from report import Report, cell, clock, medians, table
from tomoskin.imaging import OneStep
from tomoskin.model.forward import ForwardModel
from tomoskin.model.prior import PRIORS


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
        "faer ms": _ms(m, "faer"),
        "ms/faer": cell(m.ratio("forward", "faer")),
        "own ms": _ms(m, "own"),
        "ms/own": cell(m.ratio("forward", "own")),
        "script ms": _ms(m, "script forward"),
        "script ×": cell(m.ratio("script forward", "forward, script run")),
        "pyEIT ms": _ms(m, "peer forward"),
        "pyEIT ×": cell(m.ratio("peer forward", "forward")),
        "peak MB": cell(m.peak.get("forward")),
    }


def _jacobian(m: Measured) -> dict[str, Any]:
    return {
        "cells": _size(m),
        "ms": _ms(m, "jacobian"),
        "script ms": _ms(m, "script jacobian"),
        "script ×": cell(m.ratio("script jacobian", "jacobian, script run")),
        "pyEIT ms": _ms(m, "peer jacobian"),
        "pyEIT ×": cell(m.ratio("peer jacobian", "jacobian")),
        "after solves ms": _ms(m, "rows"),
        "copy ms": _ms(m, "copy"),
        "ms/copy": cell(m.ratio("rows", "copy")),
        "ms/new copy": cell(m.ratio("rows", "new copy")),
        "peak MB": cell(m.peak.get("jacobian")),
    }


def _set_up(m: Measured) -> dict[str, Any]:
    return {
        "cells": _size(m),
        "model ms": _ms(m, "model"),
        "ms": _ms(m, "set-up"),
        "pyEIT ms": _ms(m, "peer set-up"),
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


SIZES = {"660": 660, "3k": 3000, "12k": 12_000}
ALPHA, SECONDS = 0.1, 3.0
DEAD = 3
"""The electrode whose rows leave."""

APPLIED = 100
"""Frames in one timed turn: one would be too short to time."""

DENSE, MOST_DENSE = {"gaussian", "exponential", "matern"}, 5000
"""Priors that relate every cell to every other one, and the most cells with which they are made."""

Times = Mapping[str, float]


def run_inverse() -> Iterator[Report]:
    """Inverse engine: set-up of one-step operators, rows that leave."""
    cases = [disc(name, cells) for name, cells in SIZES.items()]
    models = [ForwardModel(case.mesh, PATTERN, case.contact_impedance) for case in cases]
    set_up, out = ([time(m) for m in models] for time in (_priors, _rows_out))
    yield table(
        "set-up: a conductivity → the one-step operator, ms",
        _in_ms(models, set_up, ("products", "symmetric", "jacobian", *PRIORS)),
        f"medians of {clock()[1]}",
        "priors: with the forward solution and Jacobian; mesh and model are there",
        "products: JP and PK of this size; symmetric: the first as JJᵀ, half the work",
    )
    yield table(
        f"rows that leave, {len(PATTERN.rows_of(DEAD))} of an electrode, ms",
        _in_ms(models, out, ("without", "anew", "5 rows filled")),
    )


def _in_ms(
    models: Sequence[ForwardModel], measured: Sequence[Times], names: Sequence[str]
) -> list[dict[str, str]]:
    sizes = (f"{len(model.mesh.cells):,} triangles" for model in models)
    return [
        {"cells": size}
        | {name: cell(1e3 * times[name] if name in times else None) for name in names}
        for size, times in zip(sizes, measured, strict=True)
    ]


def _priors(model: ForwardModel) -> Times:
    """Every prior, in turn with the two products that no operator can do without."""
    jacobian, small = model.jacobian(1.0), np.eye(PATTERN.n_meas)
    columns = np.random.default_rng(0).random(jacobian.shape).T
    calls: dict[str, Callable[[], object]] = {
        "products": lambda: (jacobian @ columns, columns @ small),
        "symmetric": lambda: (jacobian @ jacobian.T, columns @ small),
        "jacobian": lambda: model.jacobian(1.0),
    }
    for prior in PRIORS:
        if prior not in DENSE or len(model.mesh.cells) <= MOST_DENSE:
            calls[prior] = lambda prior=prior: OneStep(model, prior, alpha=ALPHA)
    return medians(calls, SECONDS, least=3)


def _many(call: Callable[[], object]) -> None:
    for _ in range(APPLIED):
        call()


def _rows_out(model: ForwardModel) -> Times:
    operator, rows = OneStep(model, alpha=ALPHA), PATTERN.rows_of(DEAD)
    missing = np.zeros(PATTERN.n_meas, bool)
    missing[rows[:5]] = True
    dv = np.random.default_rng(1).standard_normal(PATTERN.n_meas)
    calls: dict[str, Callable[[], object]] = {
        "without": lambda: operator.without(rows),
        "anew": lambda: OneStep(model, alpha=ALPHA),
        "5 rows filled": partial(_many, lambda: operator.filled(dv, missing)),
    }
    times = medians(calls, SECONDS)
    return times | {"5 rows filled": times["5 rows filled"] / APPLIED}
