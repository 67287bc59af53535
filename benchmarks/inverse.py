"""Inverse engine: set-up of one-step operators, applying them, rows that leave."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from forward_cases import PATTERN, Case, clock, disc, medians
from forward_tables import Promise, cell, promises
from report import Report
from tomoskin.core import FloatArray
from tomoskin.imaging import PRIORS, OneStep
from tomoskin.model.forward import ForwardModel

ALPHA = 0.1
SECONDS = 3.0
DEAD = 3
"""The electrode whose rows leave."""

APPLIED = 100
"""Frames in one timed turn: one would be too short to time."""

DENSE = {"gaussian", "exponential", "matern"}
"""Priors that relate every cell to every other one."""

MOST_DENSE = 5000
"""Cells, above which these are left out."""

Times = Mapping[str, float]


def run(data: Path | None) -> tuple[Report, ...]:
    """Time every case; ``data`` is not needed."""
    del data
    models = [_model(case) for case in (disc("660", 660), disc("3k", 3000), disc("12k", 12_000))]
    set_up = [_set_up(model) for model in models]
    applied = [_applied(model) for model in models]
    rows_out = [_rows_out(model) for model in models]
    return (
        _set_up_table(models, set_up),
        _applied_table(models, applied),
        _rows_out_table(models, rows_out),
        promises(_promises(set_up[1], applied, rows_out[1])),
    )


def _model(case: Case) -> ForwardModel:
    return ForwardModel(case.mesh, PATTERN, case.contact_impedance)


def _set_up(model: ForwardModel) -> Times:
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


def _applied(model: ForwardModel) -> Times:
    """Pictures, in turn with reading the bytes of the matrix once."""
    operator = OneStep(model, alpha=ALPHA)
    dv = np.random.default_rng(1).standard_normal(PATTERN.n_meas)
    double = np.ravel(operator.matrix, order="K")
    single = double.astype(np.float32)
    _ = operator.deferred(dv).values
    return medians(
        {
            "call": _many(lambda: operator(dv)),
            "quick": _many(lambda: operator.deferred(dv).values),
            "read double": _many(lambda: _read(double)),
            "read single": _many(lambda: _read(single)),
        },
        SECONDS,
    )


def _read(values: FloatArray) -> float:
    """Read every number once, as fast as one core can: BLAS' dot product with itself."""
    return float(values @ values)


def _many(call: Callable[[], object]) -> Callable[[], None]:
    def turn() -> None:
        for _ in range(APPLIED):
            call()

    return turn


def _rows_out(model: ForwardModel) -> Times:
    operator = OneStep(model, alpha=ALPHA)
    rows = PATTERN.rows_of(DEAD)
    missing = np.zeros(PATTERN.n_meas, bool)
    missing[rows[:5]] = True
    dv = np.random.default_rng(1).standard_normal(PATTERN.n_meas)
    return medians(
        {
            "without": lambda: operator.without(rows),
            "anew": lambda: OneStep(model, alpha=ALPHA),
            "filled": _many(lambda: operator.filled(dv, missing)),
        },
        SECONDS,
    )


def _size(model: ForwardModel) -> tuple[str, int]:
    return f"{len(model.mesh.cells):,} triangles", PATTERN.n_meas


def _set_up_table(models: list[ForwardModel], measured: list[Times]) -> Report:
    rows = [
        (
            *_size(model),
            cell(1e3 * times["products"]),
            cell(1e3 * times["symmetric"]),
            cell(1e3 * times["jacobian"]),
            *(cell(1e3 * times[prior] if prior in times else None) for prior in PRIORS),
        )
        for model, times in zip(models, measured, strict=True)
    ]
    return Report(
        "set-up: a conductivity → the one-step operator, ms",
        ("cells", "rows", "two products", "one symmetric", "Jacobian", *PRIORS),
        tuple(rows),
        (
            f"medians of {clock()[1]}",
            "priors: with the forward solution and Jacobian; mesh and model are there",
            "two products: JP and PK of this size; one symmetric: the first as JJᵀ, half the work",
        ),
    )


def _applied_table(models: list[ForwardModel], measured: list[Times]) -> Report:
    rows = [
        (
            *_size(model),
            *(
                text
                for own, read in (("call", "read double"), ("quick", "read single"))
                for text in (
                    cell(1e3 * times[own] / APPLIED),
                    cell(1e3 * times[read] / APPLIED),
                    cell(times[own] / times[read]),
                )
            ),
        )
        for model, times in zip(models, measured, strict=True)
    ]
    return Report(
        "applying: difference data → image",
        ("cells", "rows", "ms", "read ms", "ms/read", "single ms", "read ms", "ms/read"),
        tuple(rows),
        ("read: every byte of the matrix once, a dot product with itself",),
    )


def _rows_out_table(models: list[ForwardModel], measured: list[Times]) -> Report:
    rows = [
        (
            *_size(model),
            len(PATTERN.rows_of(DEAD)),
            cell(1e3 * times["without"]),
            cell(1e3 * times["anew"]),
            cell(1e3 * times["filled"] / APPLIED),
        )
        for model, times in zip(models, measured, strict=True)
    ]
    return Report(
        "rows that leave",
        ("cells", "rows", "of an electrode", "without ms", "anew ms", "5 rows filled ms"),
        tuple(rows),
    )


def _promises(set_up: Times, applied: list[Times], rows_out: Times) -> list[Promise]:
    whole = set_up["noser"]
    inner = whole - set_up["jacobian"]
    worst = {
        own: max(times[own] / times[read] for times in applied)
        for own, read in (("call", "read double"), ("quick", "read single"))
    }
    return [
        ("set-up at 3k / two products", whole / set_up["products"], 1.5, False),
        ("the same without its Jacobian", inner / set_up["products"], 1.5, False),
        ("… / the products, one symmetric", inner / set_up["symmetric"], 1.5, False),
        ("applying / reading the matrix, worst", worst["call"], 2.0, False),
        ("the same in single precision, worst", worst["quick"], 2.0, False),
        ("an electrode's rows leave at 3k, ms", 1e3 * rows_out["without"], 10.0, False),
    ]
