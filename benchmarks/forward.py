"""Forward engine: solves, Jacobians, set-up and local update against pyEIT and plain scipy."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from forward_measure import (
    ELECTRODES,
    MANY,
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
from report import Promise, Report, cell, clock, promises, table

Value = float | None


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
    yield promises(_promises(measured, touch))


def run_large() -> Iterator[Report]:
    """Forward engine on a quarter of a million triangles and a million: minutes."""
    quarter = refined(disc("62k", 62_500).mesh)
    cases = Case("250k", quarter), Case("1M", refined(quarter))
    measured = [measure(case, script=False) for case in cases]
    peak = measured[-1].peak.get("forward", 0) / 1e3 or None
    exponent: Promise = ("exponent of the forward time", _growth(measured), 1.5, False)
    yield from _tables(measured)
    yield promises([("peak of a solve at 1M, GB", peak, 8.0, False), exponent])


def _tables(measured: Sequence[Measured]) -> Iterator[Report]:
    """Solves, Jacobians and set-up of every case."""
    yield table(
        f"forward: {ELECTRODES} electrodes, adjacent, all drives",
        map(_forward, measured),
        f"medians of {clock()[1]}; × is how many times longer the other takes",
        "faer: factor and solve of the same matrix by that library as it comes, ready arrays, "
        "its analysis (minimum degree) made before, one thread; its fields agree to 1e-9",
        "own: the same by our engine",
        "script: COO assembly, splu as it comes; its voltages agree to 1e-9",
        f"{peer_name()}: point electrodes; larger meshes are left out",
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


def _growth(measured: Sequence[Measured]) -> Value:
    """Largest exponent of the forward time between two sizes, each four times the last or so."""
    sheets = [m for m in measured if m.case.mesh.dimension == 2 and m.unknowns > 1000]
    steps = [
        np.log(b.times["forward"] / a.times["forward"])
        / np.log(len(b.case.mesh.cells) / len(a.case.mesh.cells))
        for a, b in pairwise(sheets)
    ]
    return float(max(steps)) if steps else None


def _worst(measured: Sequence[Measured], name: str, own: str) -> Value:
    """Largest ratio over all cases."""
    ratios = [r for m in measured if (r := m.ratio(name, own)) is not None]
    return max(ratios, default=None)


def _ratios(measured: Sequence[Measured]) -> Callable[[str, str, str], Value]:
    """Return a look-up of ratios by the case's name."""
    known = {m.case.name: m for m in measured}
    return lambda case, name, own: known[case].ratio(name, own) if case in known else None


def _promises(measured: Sequence[Measured], touch: Measured) -> list[Promise]:
    ratio = _ratios(measured)
    peer = [("3k", 20), ("12k", 40), ("50k", 80)]
    script = [("3k", 9), ("12k", 3), ("50k", 3), ("200k", 8)]
    rows: list[Promise] = [
        (f"pyEIT: forward at {n}, ×", ratio(n, "peer forward", "forward"), least, True)
        for n, least in peer
    ]
    for what, wanted in (("jacobian", (60, 300)), ("set-up", (60, 500))):
        for n, least in zip(("3k", "12k"), wanted, strict=True):
            rows.append((f"pyEIT: {what} at {n}, ×", ratio(n, f"peer {what}", what), least, True))
    for n, least in script:
        found = ratio(n, "script forward", "forward, script run")
        rows.append((f"script: forward at {n}, ×", found, least, True))
    for n, least in (("3k", 12), ("50k", 5)):
        found = ratio(n, "script jacobian", "jacobian, script run")
        rows.append((f"script: Jacobian at {n}, ×", found, least, True))
    return [
        *rows,
        ("forward / faer alone, worst", _worst(measured, "forward", "faer"), 1.3, False),
        ("Jacobian after solves / copy, worst", _worst(measured, "rows", "new copy"), 2.0, False),
        ("local update at 3k, ms", 1e3 * touch.times["update"], 0.5, False),
        ("faer alone / local update, ×", touch.ratio("faer", "update"), 20, True),
        ("the same, each of many touches, ×", touch.ratio("faer", "many"), 20, True),
        ("own factor and solve / local update, ×", touch.ratio("own", "update"), 20, True),
        ("the same, each of many touches, ×", touch.ratio("own", "many"), 20, True),
        ("script's forward / local update, ×", touch.ratio("script forward", "update"), 20, True),
        ("exponent of the forward time, worst step", _growth(measured), 1.5, False),
    ]
