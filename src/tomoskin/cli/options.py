"""Options and arguments that several commands take, each with its sentence; most of what they mean
is in :mod:`tomoskin.cli.choices` and :mod:`tomoskin.cli.named_parts`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar

import typer

from tomoskin.cli.named_files import CALIBRATION, TABLE, Given, Reads, Writes

if TYPE_CHECKING:
    from tomoskin.core import Output
    from tomoskin.model.skin import Skin
    from tomoskin.pipeline import Idle, Prepared, Reconstruction
    from tomoskin.sensing.signal import Recording

DEFAULT_SKIN = "textile-disc-8"

_SKIN = "Built-in name or path"

# Which skin.

SkinArgument = Annotated[str, typer.Argument(metavar="SKIN", help=f"{_SKIN}.")]
NamedSkinOption = Annotated[str, typer.Option(help=f"{_SKIN}.")]
SkinOption = Annotated[
    str | None,
    typer.Option(help=f"{_SKIN}. Default: the session's skin, else {DEFAULT_SKIN}."),
]
SkinsOption = Annotated[
    list[str] | None,
    typer.Option(
        metavar="SKIN", help=f"{_SKIN}. Default: the session's skin, else {DEFAULT_SKIN}."
    ),
]
KnownSkinOption = Annotated[
    str | None, typer.Option(help=f"{_SKIN}. Default: the rows as they are in the file.")
]
SameSkinOption = Annotated[
    str | None,
    typer.Option(help=f"{_SKIN}. The command stops if the calibration belongs to another skin."),
]

# What is read.

RecordingArgument = Annotated[
    Path, typer.Argument(metavar="INPUT", help="Recording or .npz file."), Reads()
]
_SOURCE = "Source of the frames: twin, serial:PORT, replay:FILE@SPEED, …"
SourceOption = Annotated[str, typer.Option(help=_SOURCE)]
SourcesOption = Annotated[
    list[str] | None,
    typer.Option(help=f"{_SOURCE} Default: a twin."),
]
ReferenceOption = Annotated[
    str | None,
    typer.Option(
        metavar="first:N|frame:K|previous|FILE",
        help="Untouched frames; or previous: each frame is compared with the one before. "
        "Default: the file's own reference, else its first frame. For a session: the frames "
        "of the run's reference.",
    ),
]
FramesOption = Annotated[
    str | None, typer.Option(metavar="A:B", help="Only frames A to B-1, counted from 0.")
]
CalibrationsOption = Annotated[
    list[Path] | None,
    typer.Option(
        "--calibration",
        metavar="C.npz",
        help="File from tomoskin calibrate, of any kind: positions, forces, depths or "
        "whatever it is of are estimated in each frame. Once for each kind.",
    ),
    Reads(),
]

# Where results go.

CalibrationOut = Annotated[
    Path,
    typer.Option(metavar="C.npz", help="File for the calibration."),
    Writes(CALIBRATION),
]
TouchesOut = Annotated[
    Path | None,
    typer.Option(metavar="X.csv", help="File for the touches."),
    Writes(TABLE),
]
DeformationsOut = Annotated[
    Path | None,
    typer.Option(metavar="X.csv", help="File for how the sheet is deformed in each frame."),
    Writes(TABLE),
]
SinkOption = Annotated[
    list[str] | None,
    typer.Option(
        "--sink",
        metavar="SINK",
        help="Publish results: NAME or NAME:ARGUMENT. tomoskin doctor lists the names.",
    ),
]


class ImageOptions:
    """Base of options that are added to ``image``, and what else may be added to it."""

    def doubts(self, recording: Recording, prepared: Prepared) -> Iterable[str]:  # noqa: ARG002
        """What looks wrong with a recording, as sentences."""
        return ()

    def changed(
        self,
        result: Reconstruction,
        prepared: Prepared,  # noqa: ARG002
        recording: Recording,  # noqa: ARG002
        idle: Idle,  # noqa: ARG002
    ) -> Reconstruction:
        """Other images of the ``recording`` whose frames were held against ``idle``."""
        return result


class SimulateOptions:
    """Base of options that are added to ``simulate``, and what else may be added to it.

    Attributes
    ----------
    ENDINGS
        Of files that it makes, and what each holds.
    """

    ENDINGS: ClassVar[Mapping[str, str]] = {}

    @classmethod
    def outputs(cls, out: Path, given: Given, called: str) -> list[Output] | None:  # noqa: ARG003
        """The files that it writes to ``out`` where it is asked to; None where it is not."""
        return None

    def run(
        self,
        skin: Skin,
        script: Path | None,
        out: Path,
        seed: int | None,
        *,
        json: bool,
    ) -> bool:
        """Do what these options ask for; False where they ask for nothing."""
        del skin, script, out, seed, json
        return False
