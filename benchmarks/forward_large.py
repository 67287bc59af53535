"""Forward engine on a million triangles: time and memory. Takes minutes."""

from __future__ import annotations

from pathlib import Path

from forward_cases import Case, disc, refined
from forward_measure import measure
from forward_tables import forward_table, growth, jacobian_table, promises, set_up_table
from report import Report


def run(data: Path | None) -> tuple[Report, ...]:
    """Time a quarter of a million triangles and a million; ``data`` is not needed."""
    del data
    quarter = refined(disc("62k", 62_500).mesh)
    cases = Case("250k", quarter), Case("1M", refined(quarter))
    measured = [measure(case, script=False) for case in cases]
    peak = measured[-1].peak
    return (
        forward_table(measured),
        jacobian_table(measured),
        set_up_table(measured),
        promises(
            [
                ("peak of a solve at 1M, GB", peak.get("forward", 0) / 1e3 or None, 8.0, False),
                ("exponent of the forward time", growth(measured), 1.5, False),
            ]
        ),
    )
