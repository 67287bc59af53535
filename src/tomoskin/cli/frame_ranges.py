"""Labels of frames on the command line: ``LABEL=A:B``, for frames A to B-1."""

from __future__ import annotations

from collections.abc import Sequence

import typer

from tomoskin.core import DataError


def labels_of_frames(given: Sequence[str], n: int, option: str, label: str) -> list[str]:
    """(n,) label of each frame, "" without one.

    ``option`` and ``label`` are what the command calls them: ``--class``, ``NAME``.
    Raises BadParameter on a malformed text, DataError on frames that do not exist or that have
    two labels.
    """
    labels = [""] * n
    for text in given:
        name, equals, span = text.rpartition("=")
        first, colon, last = span.partition(":")
        if not (name and equals and colon and first.isdigit() and last.isdigit()):
            raise typer.BadParameter(f'expected {label}=A:B, got "{text}"', param_hint=option)
        start, stop = int(first), int(last)
        if not 0 <= start < stop <= n:
            raise DataError(f"expected frames within 0:{n}, got {span}", where=f"{option} {name}")
        taken = sorted({labels[k] for k in range(start, stop)} - {"", name})
        if taken:
            raise DataError(
                f"frames of {span} already have the label {taken[0]}",
                where=f"{option} {name}",
                hint=f"give each frame one {label}",
            )
        labels[start:stop] = [name] * (stop - start)
    return labels
