"""Forward engine: solves, Jacobians, set-up and local update against pyEIT and plain scipy."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

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
from report import Report, cell, clock, table


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
