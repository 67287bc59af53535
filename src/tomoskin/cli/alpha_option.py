"""The option --alpha: a number, or the rule that chooses it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from tomoskin.inverse import AlphaChoice
    from tomoskin.skin import Skin

AlphaOption = Annotated[
    str | None,
    typer.Option(
        metavar="NUMBER|auto|RULE",
        help="Weight of the prior instead of the skin's; RULE as listed by `skin alpha`.",
    ),
]


def with_alpha(skin: Skin, wanted: str | None) -> tuple[Skin, str | None]:
    """The skin with the alpha of the option, and the rule that is to choose it, if one is."""
    from tomoskin.inverse import RULES

    if wanted is None or wanted in RULES:
        return skin, wanted
    alpha = "auto" if wanted == "auto" else _number(wanted)
    return skin.altered({"inverse": {"alpha": alpha}}), None


def said(choice: AlphaChoice) -> str:
    """One line about a choice."""
    return f"alpha {choice.alpha:.4g} ({choice.rule}: {choice.reason})"


def _number(wanted: str) -> float:
    from tomoskin.inverse import RULES

    try:
        number = float(wanted)
    except ValueError:
        number = -1.0
    if not 1e-9 <= number <= 1e9:
        rules = ", ".join(RULES)
        raise typer.BadParameter(
            f'expected a number above 0, auto or a rule among {rules}; got "{wanted}"',
            param_hint="--alpha",
        )
    return number
