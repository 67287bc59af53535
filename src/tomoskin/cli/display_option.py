"""The options of how images are shown: unit, colour scale, averaging filter."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from tomoskin.formats import Display
    from tomoskin.skin import Skin

PercentFlag = Annotated[
    bool, typer.Option("--percent", help="Changes as a part of the skin's own conductivity.")
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


def display_of(skin: Skin, *, percent: bool, limit: float | None, smooth: str | None) -> Display:
    """What the options mean for ``skin``. Raises DataError for what cannot be."""
    from tomoskin.formats import Display

    return Display(
        conductivity=skin.conductivity if percent else None,
        smoothing=0.0 if smooth is None else _length(smooth),
        limit=limit / 100.0 if percent and limit is not None else limit,
    )


def _length(text: str) -> float:
    from tomoskin.core import parse_quantity

    try:
        return parse_quantity(text, "length")
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint="--smooth") from error
