"""Command line of the examples on soft bodies, which are made by models of their own."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path


def options_of(arguments: Sequence[str] | None, title: str | None) -> argparse.Namespace:
    """Folder of the figure (made if it is not there), and seed."""
    parser = argparse.ArgumentParser(
        description=title, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("figures"), help="folder of the figure")
    parser.add_argument("--seed", type=int, default=1, help="of sheet, noise and chance")
    options = parser.parse_args(arguments)
    options.out.mkdir(parents=True, exist_ok=True)
    return options
