"""``tomoskin image --sharp``."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import typer

from tomoskin.cli import Bar, ImageOptions

if TYPE_CHECKING:
    from tomoskin.pipeline import Idle, Prepared, Reconstruction
    from tomoskin.sensing.signal import Recording


@dataclass(frozen=True)
class Sharp(ImageOptions):
    """Images with edges in place of smooth ones."""

    sharp: Annotated[
        bool,
        typer.Option(
            "--sharp",
            help="Images with edges, by total variation, instead of smooth ones; slower. Touches "
            "stay as they are.",
        ),
    ] = False

    def changed(
        self, result: Reconstruction, prepared: Prepared, recording: Recording, idle: Idle
    ) -> Reconstruction:
        """With such images, where they are asked for."""
        if not self.sharp:
            return result
        from tomoskin.extras.absolute.sharpened import sharpened

        with Bar("sharpening") as bar:
            return sharpened(result, prepared, recording, idle, bar)
