"""Which skin a command works with when it is not told: that of the recording, if it has one."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from tomoskin.skin import Skin

DEFAULT_SKIN = "textile-disc-8"

SkinOption = Annotated[
    str | None,
    typer.Option(
        help=f"Built-in name or path; without it that of the session, else {DEFAULT_SKIN}."
    ),
]
"""The --skin option of a command that may read a session."""


def skin_for_source(skin: str | None, source: str) -> Skin:
    """The skin named, or the one in the session that ``source`` replays, or the default."""
    from tomoskin.recording import parse_replay
    from tomoskin.skin import Skin

    name, _, argument = source.partition(":")
    if skin is None and name == "replay":
        return skin_for_file(None, parse_replay(argument)[0])
    return Skin.load(DEFAULT_SKIN if skin is None else skin)


def known_skin(skin: str | None, path: Path) -> Skin | None:
    """The skin named, or the one in the session ``path``; None where neither says one."""
    from tomoskin.formats import is_session

    return skin_for_file(skin, path) if skin is not None or is_session(path) else None


def skin_for_file(skin: str | None, path: Path) -> Skin:
    """The skin named, or the one in the session ``path``, or the default."""
    from tomoskin.formats import is_session
    from tomoskin.recording import SessionReader
    from tomoskin.skin import Skin

    if skin is None and is_session(path):
        with SessionReader(path) as session:
            return session.skin
    return Skin.load(DEFAULT_SKIN if skin is None else skin)
