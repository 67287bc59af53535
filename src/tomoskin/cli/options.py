"""Options and arguments that several commands take, each with its sentence; most of what they mean
is in :mod:`tomoskin.cli.choices` and :mod:`tomoskin.cli.recording`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tomoskin.cli.named_files import CALIBRATION, TABLE, Reads, Writes

DEFAULT_SKIN = "textile-disc-8"

_SKIN = "Built-in name or path"

# Which skin.

SkinArgument = Annotated[str, typer.Argument(metavar="SKIN", help=f"{_SKIN}.")]
NamedSkinOption = Annotated[str, typer.Option(help=f"{_SKIN}.")]
SkinOption = Annotated[
    str | None,
    typer.Option(help=f"{_SKIN}; without it that of the session, else {DEFAULT_SKIN}."),
]
SkinsOption = Annotated[
    list[str] | None,
    typer.Option(
        metavar="[NAME=]SKIN",
        help=f"{_SKIN}; without it that of the session, else {DEFAULT_SKIN}. With a name, once "
        "for each of several skins.",
    ),
]
KnownSkinOption = Annotated[
    str | None, typer.Option(help=f"{_SKIN}; without it the rows are taken as they are.")
]
SameSkinOption = Annotated[
    str | None, typer.Option(help=f"{_SKIN}: refused unless calibrated on it.")
]

# What is read.

RecordingArgument = Annotated[
    Path, typer.Argument(metavar="INPUT", help="Recording or .npz file."), Reads()
]
LabelledArgument = Annotated[
    Path, typer.Argument(metavar="INPUT", help="Frames with labels: one touch each."), Reads()
]
_SOURCE = "Where frames come from: twin, serial:PORT, replay:FILE@SPEED, …"
SourceOption = Annotated[str, typer.Option(help=_SOURCE)]
SourcesOption = Annotated[
    list[str] | None,
    typer.Option(help=f"{_SOURCE} Once for each skin, in their order; without it twins."),
]
ReferenceOption = Annotated[
    str | None,
    typer.Option(
        metavar="first:N|frame:K|previous|FILE",
        help="Untouched frames, or previous: each frame against the one before. Without it the "
        "file's own reference, else its first frame (of a session those that the run took).",
    ),
]
FramesOption = Annotated[
    str | None, typer.Option(metavar="A:B", help="Only frames A to B-1 (from 0).")
]
CalibrationsOption = Annotated[
    list[Path] | None,
    typer.Option(
        "--calibration",
        "--bend",
        "--states",
        "--newtons",
        metavar="C.npz",
        help="From tomoskin calibrate, of any kind: positions and forces of touches, bends or "
        "states are read in each frame; once for each kind.",
    ),
    Reads(),
]

# What of the skin is changed for this run.

AlphaOption = Annotated[
    str | None,
    typer.Option(
        metavar="NUMBER|auto|RULE",
        help="Weight of the prior instead of the skin's; RULE as listed by `skin alpha`.",
    ),
]
TimeConstantOption = Annotated[
    str | None,
    typer.Option(
        metavar="TIME",
        help='Time constant of the images, such as "0.2 s", instead of the skin\'s; "0 s": each '
        "frame by itself.",
    ),
]

# How images are shown.

PercentFlag = Annotated[
    bool, typer.Option("--percent", help="Show changes as a part of the skin's own conductivity.")
]
LimitOption = Annotated[
    float | None,
    typer.Option(metavar="X", help="End of the colour scale, in S or per cent as shown."),
]
SmoothOption = Annotated[
    str | None,
    typer.Option(
        metavar="LENGTH",
        help='Average over discs of this radius, such as "8 mm"; for the eye, not for touches.',
    ),
]

# Where results go.

CalibrationOut = Annotated[
    Path,
    typer.Option(metavar="C.npz", help="Where the calibration goes."),
    Writes(CALIBRATION),
]
TouchesOut = Annotated[
    Path | None,
    typer.Option(metavar="X.csv", help="Where the touches go."),
    Writes(TABLE),
]
SinkOption = Annotated[
    list[str] | None,
    typer.Option(
        "--sink",
        metavar="SINK",
        help="Publish results: foxglove:8766, mqtt://HOST:1883/TOPIC, lsl, zenoh, ros2, rerun, …",
    ),
]
