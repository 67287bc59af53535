"""The option --time-constant: a filter over frames instead of the skin's."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from tomoskin.skin import Skin

TimeConstantOption = Annotated[
    str | None,
    typer.Option(
        metavar="TIME",
        help='How long a picture lasts, such as "0.2 s", instead of the skin\'s; "0 s": each frame '
        "by itself.",
    ),
]


def with_time_constant(skin: Skin, wanted: str | None) -> Skin:
    """The skin with the time constant of the option."""
    from tomoskin.core import parse_quantity

    if wanted is None:
        return skin
    try:
        parse_quantity(wanted, "time")
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint="--time-constant") from error
    return skin.altered({"inverse": {"time_constant": wanted}})


def filter_said(skin: Skin) -> str:
    """One line about the filter."""
    return f"filtered over frames, time constant {skin.inverse.time_constant:g} s"
