"""Tables of the forward benchmarks, and what was promised beside what was reached."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np

import forward_peer
from forward_cases import ELECTRODES, clock
from forward_measure import MANY, TOUCH, Measured
from report import Report, cell

Value = float | None


def _ms(measured: Measured, name: str) -> str:
    found = measured.times.get(name)
    return cell(None if found is None else 1e3 * found)


def _size(measured: Measured) -> tuple[str, str]:
    kind = "triangles" if measured.case.mesh.dimension == 2 else "tetrahedra"
    return f"{len(measured.case.mesh.cells):,} {kind}", f"{measured.unknowns:,}"


def forward_table(measured: Sequence[Measured]) -> Report:
    """Forward solves, and the factor and solve in them."""
    rows = [
        (
            *_size(m),
            _ms(m, "forward"),
            _ms(m, "faer"),
            cell(m.ratio("forward", "faer")),
            _ms(m, "own"),
            cell(m.ratio("forward", "own")),
            _ms(m, "script forward"),
            cell(m.ratio("script forward", "forward, script run")),
            _ms(m, "peer forward"),
            cell(m.ratio("peer forward", "forward")),
            cell(m.peak.get("forward")),
        )
        for m in measured
    ]
    columns = ("cells", "unknowns", "ms", "faer ms", "ms/faer", "own ms", "ms/own")
    return Report(
        f"forward: {ELECTRODES} electrodes, adjacent, all drives",
        (*columns, "script ms", "script ×", "pyEIT ms", "pyEIT ×", "peak MB"),
        tuple(rows),
        (
            f"medians of {clock()[1]}; × is how many times longer the other takes",
            "faer: factor and solve of the same matrix by that library as it comes, ready arrays, "
            "its analysis (minimum degree) made before, one thread; its fields agree to 1e-9",
            "own: the same by our engine",
            "script: COO assembly, splu as it comes; its voltages agree to 1e-9",
            f"{forward_peer.name()}: point electrodes; larger meshes are left out",
            "peak: resident memory above that of the process with its mesh, in its own process",
        ),
    )


def jacobian_table(measured: Sequence[Measured]) -> Report:
    """Jacobians with their solves, and the writing of the result."""
    rows = [
        (
            _size(m)[0],
            _ms(m, "jacobian"),
            _ms(m, "script jacobian"),
            cell(m.ratio("script jacobian", "jacobian, script run")),
            _ms(m, "peer jacobian"),
            cell(m.ratio("peer jacobian", "jacobian")),
            _ms(m, "rows"),
            _ms(m, "copy"),
            cell(m.ratio("rows", "copy")),
            cell(m.ratio("rows", "new copy")),
            cell(m.peak.get("jacobian")),
        )
        for m in measured
    ]
    columns = ("cells", "ms", "script ms", "script ×", "pyEIT ms", "pyEIT ×", "after solves ms")
    return Report(
        "Jacobian with its solves",
        (*columns, "copy ms", "ms/copy", "ms/new copy", "peak MB"),
        tuple(rows),
        (
            "after solves: gradients and rows, written to new memory",
            "new copy: an array of the result's size, to new memory too; copy: into one in use",
        ),
    )


def set_up_table(measured: Sequence[Measured]) -> Report:
    """From a mesh to the one-step operator."""
    rows = [
        (
            _size(m)[0],
            _ms(m, "model"),
            _ms(m, "set-up"),
            _ms(m, "peer set-up"),
            cell(m.ratio("peer set-up", "set-up")),
        )
        for m in measured
    ]
    return Report(
        "set-up: points and cells → one-step operator (NOSER)",
        ("cells", "model ms", "ms", "pyEIT ms", "pyEIT ×"),
        tuple(rows),
        (
            "model: structure, maps and analysis alone, from a checked mesh",
            "check of the mesh included in the rest; pyEIT: JAC with p = 0.5",
        ),
    )


def touch_table(m: Measured) -> Report:
    """Local update."""
    rows = tuple(
        (_size(m)[0], what, _ms(m, own), *(cell(m.ratio(n, own)) for n in _FRESH))
        for what, own in (("one", "update"), (f"each of {MANY}", "many"))
    )
    return Report(
        f"local update: touches of {TOUCH} cells, columns in hand",
        ("cells", "touches", "ms", "faer ×", "own ×", "forward ×", "script ×"),
        rows,
        (
            "× is how many times longer a fresh one takes",
            "faer and own: factor and solve alone, as in the table of forward solves",
        ),
    )


_FRESH = ("faer", "own", "forward", "script forward")


def growth(measured: Sequence[Measured]) -> Value:
    """Largest exponent of the forward time between two sizes, each four times the last or so."""
    sheets = [m for m in measured if m.case.mesh.dimension == 2 and m.unknowns > 1000]
    steps = [
        np.log(b.times["forward"] / a.times["forward"])
        / np.log(len(b.case.mesh.cells) / len(a.case.mesh.cells))
        for a, b in pairwise(sheets)
    ]
    return float(max(steps)) if steps else None


Promise = tuple[str, Value, float, bool]
"""What, reached, promised, and whether more is better."""


def promises(rows: Sequence[Promise]) -> Report:
    """Say which are met."""
    table = []
    for what, reached, promised, more in rows:
        met = "not measured"
        if reached is not None:
            met = "yes" if (reached >= promised if more else reached <= promised) else "no"
        table.append((what, f"{'≥' if more else '≤'} {promised:g}", cell(reached), met))
    return Report("promised and reached", ("what", "promised", "reached", "met"), tuple(table))


def worst(measured: Sequence[Measured], name: str, own: str) -> Value:
    """Largest ratio over all cases."""
    found = [r for m in measured if (r := m.ratio(name, own)) is not None]
    return max(found, default=None)


Ratio = Callable[[str, str, str], Value]


def ratios(measured: Sequence[Measured]) -> Ratio:
    """Return a look-up of ratios by the case's name."""
    known = {m.case.name: m for m in measured}
    return lambda case, name, own: known[case].ratio(name, own) if case in known else None
