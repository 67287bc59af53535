"""Command line of the examples on soft bodies, which are made by models of their own."""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from figure_file import chosen, parser_of


def options_of(name: str, arguments: Sequence[str] | None, title: str | None) -> argparse.Namespace:
    """File of the figure, and seed."""
    parser = parser_of(title)
    parser.add_argument("--seed", type=int, default=1, help="of sheet, noise and chance")
    return chosen(parser, arguments, name)
