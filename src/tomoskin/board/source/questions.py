"""What a board answers before anything is scanned: who it is, and what it has lost."""

from __future__ import annotations

from tomoskin.board.source.agreement import LOSSES_SINCE
from tomoskin.board.source.transport import Exchange, Transport
from tomoskin.board.wire import GetInfo, GetLosses, Info, Losses
from tomoskin.core import SourceError

_AGAIN, _TRIES = 0.5, 10
"""Seconds after which a board is asked again, and how often: it may have to start first."""


def ask_info(transport: Transport) -> Info:
    """What a firmware says of itself, asked until it answers; SourceError where none does."""
    info = Exchange(transport).ask(GetInfo(0), Info, patience=_AGAIN, tries=_TRIES)
    if info is None:
        raise SourceError(
            f"no firmware has answered for {_AGAIN * _TRIES:.0f} s",
            where=transport.name,
            hint="is it the board's port? tomoskin firmware flash comes first",
        )
    return info


def ask_losses(transport: Transport) -> Losses | None:
    """What a board has lost since its power came up; None where its firmware does not count.

    Raises
    ------
    SourceError
        Where no firmware answers.
    """
    if ask_info(transport).minor < LOSSES_SINCE:
        return None
    return Exchange(transport).ask(GetLosses(0), Losses)
