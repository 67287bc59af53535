"""Inverse engine: set-up of one-step operators, applying them, rows that leave; choice of alpha."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial

import numpy as np

from forward_measure import PATTERN, disc
from report import Report, cell, clock, medians, table
from tomoskin.imaging import PRIORS, OneStep, Spectrum
from tomoskin.model.forward import ForwardModel
from tomoskin.model.skin import Skin
from tomoskin.pipeline import Prepared, prepare
from tomoskin.pipeline.tune import tune
from tomoskin.sensing.signal import Reference

SIZES = {"660": 660, "3k": 3000, "12k": 12_000}
ALPHA, SECONDS = 0.1, 3.0
DEAD = 3
"""The electrode whose rows leave."""

APPLIED = 100
"""Frames in one timed turn: one would be too short to time."""

DENSE, MOST_DENSE = {"gaussian", "exponential", "matern"}, 5000
"""Priors that relate every cell to every other one, and the most cells with which they are made."""

CHOSEN_CELLS, CHOSEN_SECONDS = (660, 3000), 2.0
"""Of the choice of alpha: triangles, and s to time."""

LOUD = 3.0
"""Noise of the reference, in parts of what the read-out predicts: the operator is made anew."""

Times = Mapping[str, float]


def run() -> Iterator[Report]:
    cases = [disc(name, cells) for name, cells in SIZES.items()]
    models = [ForwardModel(case.mesh, PATTERN, case.contact_impedance) for case in cases]
    set_up, applied, out = ([time(m) for m in models] for time in (_set_up, _applied, _rows_out))
    yield table(
        "set-up: a conductivity → the one-step operator, ms",
        _in_ms(models, set_up, ("products", "symmetric", "jacobian", *PRIORS)),
        f"medians of {clock()[1]}",
        "priors: with the forward solution and Jacobian; mesh and model are there",
        "products: JP and PK of this size; symmetric: the first as JJᵀ, half the work",
    )
    yield table(
        "applying: difference data → image, ms",
        _in_ms(models, applied, ("double", "read double", "single", "read single")),
        "read: every byte of the matrix once, a dot product with itself",
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
    """Images, in turn with reading the bytes of the matrix once."""
    operator = OneStep(model, alpha=ALPHA)
    dv = np.random.default_rng(1).standard_normal(PATTERN.n_meas)
    double = np.ravel(operator.matrix, order="K")
    single = double.astype(np.float32)
    operator.quick(dv)
    calls: dict[str, Callable[[], object]] = {
        "double": lambda: operator(dv),
        "single": lambda: operator.quick(dv),
        "read double": lambda: float(double @ double),
        "read single": lambda: float(single @ single),
    }
    times = medians({name: partial(_many, call) for name, call in calls.items()}, SECONDS)
    return {name: seconds / APPLIED for name, seconds in times.items()}


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


def run_alpha() -> Iterator[Report]:
    """Choice of alpha: another operator, and a frame that waits for it."""
    skin = Skin.load("textile-disc-16").altered({"inverse": {"alpha": "auto"}})
    rows = []
    for cells in CHOSEN_CELLS:
        prepared = prepare(skin.altered({"mesh": {"cells": cells}}))
        spectrum = Spectrum.of(prepared.problem)
        calls: dict[str, Callable[[], object]] = {
            "spectrum": lambda p=prepared: Spectrum.of(p.problem),
            "operator from it": lambda s=spectrum: s.operator(ALPHA),
            "operator without": lambda p=prepared: p.problem.operator(ALPHA),
        }
        times = medians(calls, CHOSEN_SECONDS, least=3)
        times["longest wait of a frame"] = max(_waits(prepared))
        size = {"triangles": f"{len(prepared.mesh.cells):,}"}
        rows.append(size | {name: cell(1e3 * seconds) for name, seconds in times.items()})
    yield table(
        "another alpha: 16 electrodes, 208 rows, ms",
        rows,
        f"medians of {clock()[1]}; longest wait: the most that any one frame does while the "
        "operator changes, noise of the image included",
    )


def _waits(prepared: Prepared) -> list[float]:
    """Seconds of each step of a change of operator, and of the noise of its image after it."""
    rng, now = np.random.default_rng(1), clock()[0]
    mean = prepared.operator.reference
    noise = LOUD * prepared.readout.noise * rng.standard_normal((20, len(mean)))
    reference = Reference.of(mean + noise)
    steps, taken, better = tune(prepared, reference), [], None
    while better is None:
        began = now()
        if (better := next(steps)) is not None:
            better.image_noise(reference)
        taken.append(now() - began)
    return taken
