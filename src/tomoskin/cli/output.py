"""What all commands write alike: JSON for programs."""

from __future__ import annotations

from typing import Annotated, Any

import typer

JsonFlag = Annotated[bool, typer.Option("--json", help="Machine-readable output.")]
"""The --json option of a command."""


def emit(document: Any) -> None:
    """Write ``document`` as one line of JSON on stdout, at once."""
    import msgspec

    typer.echo(msgspec.json.encode(document).decode())
