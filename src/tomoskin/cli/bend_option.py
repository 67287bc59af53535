"""The option that names a calibration of bends."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tomoskin.cli.named_files import Reads

if TYPE_CHECKING:
    from tomoskin.pipeline import Prepared

BendOption = Annotated[
    Path | None,
    typer.Option(
        metavar="C.npz", help="From tomoskin calibrate bend: bends are taken out, and read."
    ),
    Reads(),
]


def with_bends(prepared: Prepared, path: Path | None) -> Prepared:
    """The skin with its bends, where a calibration is named. Raises DataError for others."""
    from tomoskin.calibration import BENDS

    if path is None:
        return prepared
    return prepared.calibrated(BENDS.read(path))
