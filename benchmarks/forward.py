"""Forward engine: solves, Jacobians, set-up and local update against pyEIT and plain scipy."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from forward_cases import Case, disc, refined, tank
from forward_measure import Measured, measure, measure_touch
from forward_tables import (
    Promise,
    forward_table,
    growth,
    jacobian_table,
    promises,
    ratios,
    set_up_table,
    touch_table,
    worst,
)
from report import Report


def run(data: Path | None) -> tuple[Report, ...]:
    """Time every case; ``data`` is not needed."""
    del data
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
    return (
        forward_table(measured),
        jacobian_table(measured),
        set_up_table(measured),
        touch_table(touch),
        promises(_promises(measured, touch)),
    )


def _promises(measured: Sequence[Measured], touch: Measured) -> list[Promise]:
    ratio = ratios(measured)
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
        ("forward / faer alone, worst", worst(measured, "forward", "faer"), 1.3, False),
        ("Jacobian after solves / copy, worst", worst(measured, "rows", "new copy"), 2.0, False),
        ("local update at 3k, ms", 1e3 * touch.times["update"], 0.5, False),
        ("faer alone / local update, ×", touch.ratio("faer", "update"), 20, True),
        ("the same, each of many touches, ×", touch.ratio("faer", "many"), 20, True),
        ("own factor and solve / local update, ×", touch.ratio("own", "update"), 20, True),
        ("the same, each of many touches, ×", touch.ratio("own", "many"), 20, True),
        ("script's forward / local update, ×", touch.ratio("script forward", "update"), 20, True),
        ("exponent of the forward time, worst step", growth(measured), 1.5, False),
    ]
