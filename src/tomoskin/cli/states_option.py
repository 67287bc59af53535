"""The option that names a calibration of states."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tomoskin.cli.named_files import Reads

if TYPE_CHECKING:
    from tomoskin.pipeline import Prepared
    from tomoskin.skin import Skin

StatesOption = Annotated[
    Path | None,
    typer.Option(
        metavar="C.npz", help="From tomoskin calibrate states: the state of each frame is told."
    ),
    Reads(),
]


def with_states(prepared: Prepared, path: Path | None, skin: Skin) -> Prepared:
    """The skin with its states, where a calibration is named.

    ``skin`` as its file says, whatever pictures are made of it. Raises DataError for states of
    another.
    """
    from tomoskin.calibration import CLASSES

    if path is None:
        return prepared
    calibration = CLASSES.read(path)
    calibration.model.classifier.check(skin_id=skin.identity)
    return prepared.calibrated(calibration)
