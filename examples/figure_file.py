"""Where an example's figure goes: looked at before anything is measured."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from matplotlib.figure import Figure

from tomoskin.core import RECORDING, Output, OutputError, check_outputs, written

PICTURE = {".png": "the figure"}

DOTS = 130
"""Of a picture, an inch."""


@dataclass(frozen=True)
class FigureFile:
    """A name for a figure, and whether a file of that name may be written over."""

    path: Path
    overwrite: bool

    def save(self, made: Figure) -> Path:
        """Write the figure."""
        with written(self.path, overwrite=self.overwrite) as part:
            made.savefig(part, dpi=DOTS)
        return self.path


def parser_of(title: str | None) -> argparse.ArgumentParser:
    """A command line with the folder of the figure."""
    parser = argparse.ArgumentParser(
        description=title, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("figures"), help="folder of the figure")
    parser.add_argument("--force", action="store_true", help="write over a figure that is there")
    parser.add_argument("--json", action="store_true", help="print the numbers as JSON")
    return parser


def chosen(
    parser: argparse.ArgumentParser, arguments: Sequence[str] | None, name: str
) -> argparse.Namespace:
    """The options, with ``figure``: the file ``name``.png of the folder, which is made.

    Ends the program where the figure, or a recording that is asked for, cannot be written.
    """
    options = parser.parse_args(arguments)
    options.figure = FigureFile(options.out / f"{name}.png", options.force)
    outputs = [Output(options.figure.path, PICTURE, "--out", makes_folders=True)]
    if getattr(options, "record", None):
        outputs.append(Output(options.record, RECORDING, "--record"))
    try:
        check_outputs(outputs, overwrite=options.force, consent="--force")
    except OutputError as error:
        parser.error(str(error))
    options.out.mkdir(parents=True, exist_ok=True)
    return options
