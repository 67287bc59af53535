"""Why no board answers behind a serial port: the likeliest cause, from what was heard there."""

from __future__ import annotations

from dataclasses import dataclass

from tomoskin.core import SourceError

PICO = "Raspberry Pi Pico"
"""What a port with a Pico behind it is called: it is flashed by its boot drive, not by the port."""

BAUD = 1_000_000
"""Rate that the firmware starts with: exact at 16 MHz."""

SIGN_ON = bytes.fromhex("1b 01 00 01 0e 01 14")
"""Asks the bootloader of a Mega 2560 who it is (STK500v2, AVR068: CMD_SIGN_ON in a message)."""

SIGN_ON_RATE = 115_200
_ANSWER = (b"\x1b\x01", b"\x0e\x01")

_TEXT = 0.9
"""Part of the bytes that is printable where something speaks in words."""

_SHOWN = 40


@dataclass(frozen=True, slots=True)
class Silence:
    """What is known of a port behind which no board has said HELLO.

    Attributes
    ----------
    port
        Its name.
    board
        What is behind it by its USB identity; empty where nobody knows.
    rate
        Bd.
    heard
        The first bytes that came.
    bootloader
        What came when a bootloader was asked.
    ports
        The ports of this machine, in words.
    """

    port: str
    board: str
    rate: int
    heard: bytes
    bootloader: bytes
    ports: str

    @property
    def cause(self) -> SourceError:
        """The likeliest, and what to do."""
        target = "--board pico" if self.board == PICO else self.port
        flash = f"tomoskin firmware flash {target}"
        if is_bootloader(self.bootloader):
            text, hint = "the board is in its bootloader and has no firmware", flash
        elif is_text(self.heard):
            letters = (chr(byte) if 32 <= byte < 127 else " " for byte in self.heard)
            shown = " ".join("".join(letters).split())[:_SHOWN]
            text = f'another program or device answers ("{shown}"), or this is the wrong port'
            hint = f"{flash}, or {self.ports}"
        elif self.heard and self.rate != BAUD:
            text = (
                f"the bytes that arrive at {self.rate:,} Bd are not messages: the rate is "
                "probably wrong"
            )
            hint = f"leave out baud=: the firmware starts with {BAUD:,} Bd"
        elif self.heard:
            text = (
                f"the bytes that arrive at {self.rate:,} Bd are not messages: probably another "
                "program runs on the board"
            )
            hint = f"{flash}; firmware of another rate needs serial:{self.port},baud=RATE"
        elif self.board:
            text = f"the board ({self.board}) sends nothing: it probably has no firmware"
            hint = f"{flash}; check also that it has power"
        else:
            text, hint = (
                ("nothing arrives: this is probably the wrong port, or the board has no power"),
                self.ports,
            )
        return SourceError(text, where=f"serial:{self.port}", hint=hint)


def is_bootloader(answer: bytes) -> bool:
    """Whether that is a bootloader's answer to :data:`SIGN_ON`."""
    return answer[:2] == _ANSWER[0] and answer[4:6] == _ANSWER[1]


def is_text(heard: bytes) -> bool:
    """Whether the bytes read as text."""
    printable = sum(32 <= byte < 127 or byte in b"\r\n\t" for byte in heard)
    return bool(heard) and printable >= _TEXT * len(heard)
