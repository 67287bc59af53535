"""``tomoskin calibrate touch --onto OLD.npz --unlabelled``: an older calibration aligned to today
by touches without labels."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import typer

from tomoskin.cli import Bar, Recorded, remark
from tomoskin.core import DataError, FloatArray

if TYPE_CHECKING:
    from tomoskin.learning import Calibration, Locator


@dataclass(frozen=True)
class Unlabelled:
    """The option, and what it does."""

    unlabelled: Annotated[
        bool,
        typer.Option(
            "--unlabelled",
            help="With --onto: frames without a label are touches too, all over the skin. They "
            "align the old calibration to today, and labels are optional.",
        ),
    ] = False

    def aligned(
        self, given: Recorded, old: Calibration[Locator] | None
    ) -> Calibration[Locator] | None:
        """The ``old`` calibration for the session that is given; None where none was asked for."""
        if not self.unlabelled:
            return None
        if old is None:
            raise DataError(
                "--unlabelled aligns an older calibration, but none is given",
                hint="add --onto OLD.npz",
            )
        return old.with_model(_aligned(old.model, given.dv, given.labels))


def _aligned(locator: Locator, dv: FloatArray, xy: FloatArray) -> Locator:
    """The locator for the session of these frames; what has changed is said."""
    from tomoskin.extras.alignment.session_alignment import SessionAlignment

    alignment = SessionAlignment.of(locator, dv, xy)
    if not alignment.holds:
        raise DataError("; ".join(alignment.findings))
    for finding in alignment.findings:
        remark(finding)
    with Bar("learning") as bar:
        return alignment.locator(locator, bar)
