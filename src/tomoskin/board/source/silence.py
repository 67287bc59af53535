"""Why no board answers behind a serial port: the likeliest cause, from what was heard there."""

from __future__ import annotations

from tomoskin.board.source.boards import BOARDS
from tomoskin.core import SourceError

BAUD = 1_000_000
"""Rate that the firmware starts with: exact at 16 MHz."""

SIGN_ON = bytes.fromhex("1b 01 00 01 0e 01 14")
"""Asks the bootloader of a Mega 2560 who it is (STK500v2, AVR068: CMD_SIGN_ON in a message)."""

SIGN_ON_RATE = 115_200
_ANSWER = (b"\x1b\x01", b"\x0e\x01")

_TEXT = 0.9
"""Part of the bytes that is printable where something speaks in words."""

_SHOWN = 40


def likely_cause(
    port: str, board: str, *, rate: int, heard: bytes, bootloader: bytes, ports: str
) -> SourceError:
    """Why no board has said HELLO behind a ``port``, and what to do.

    ``board`` is what its USB identity says, or nothing; ``heard`` are the first bytes that came at
    ``rate`` Bd, ``bootloader`` what came when a bootloader was asked. ``ports`` names those here.
    """
    by_drive = [key for key, one in BOARDS.items() if one.text == board and one.flash == "uf2"]
    flash = "tomoskin firmware flash " + (f"--board {by_drive[0]}" if by_drive else port)
    not_messages = f"the bytes that arrive at {rate:,} Bd are not messages: "
    if is_bootloader(bootloader):
        text, hint = "the board is in its bootloader and has no firmware", flash
    elif is_text(heard):
        letters = (chr(byte) if 32 <= byte < 127 else " " for byte in heard)
        shown = " ".join("".join(letters).split())[:_SHOWN]
        text = f'another program or device answers ("{shown}"), or this is the wrong port'
        hint = f"{flash}, or {ports}"
    elif heard and rate != BAUD:
        text = f"{not_messages}the rate is probably wrong"
        hint = f"leave out baud=: the firmware starts with {BAUD:,} Bd"
    elif heard:
        text = f"{not_messages}probably another program runs on the board"
        hint = f"{flash}; firmware of another rate needs serial:{port},baud=RATE"
    elif board:
        text = f"the board ({board}) sends nothing: it probably has no firmware"
        hint = f"{flash}; check also that it has power"
    else:
        text = "nothing arrives: this is probably the wrong port, or the board has no power"
        hint = ports
    return SourceError(text, where=f"serial:{port}", hint=hint)


def is_bootloader(answer: bytes) -> bool:
    """Whether that is a bootloader's answer to :data:`SIGN_ON`."""
    return answer[:2] == _ANSWER[0] and answer[4:6] == _ANSWER[1]


def is_text(heard: bytes) -> bool:
    """Whether the bytes read as text."""
    printable = sum(32 <= byte < 127 or byte in b"\r\n\t" for byte in heard)
    return bool(heard) and printable >= _TEXT * len(heard)
