"""What is written into a board: its firmware, and what the board is, by avrdude."""

from __future__ import annotations

import secrets
import shutil
import struct
import subprocess
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Self

from tomoskin.board.source import BOARDS_SINCE, Exchange, SerialTransport, Transport
from tomoskin.board.wire import BoardLimits, GetBoard, GetInfo, Info
from tomoskin.core import SourceError
from tomoskin.twin.emulator.program import firmware_image

MOST_CURRENT = 0.1
"""A, that the parts of the board are made for."""

_REFERENCE = 1.225
"""V across the board's sense resistor."""

_AVRDUDE = ("avrdude", "-q", "-q", "-p", "atmega2560", "-c", "wiring", "-b", "115200", "-D", "-P")
_LONGEST = 60.0
_HINT = "is it the board's port, and does nothing else use it?"
_AGAIN, _TRIES = 0.5, 10
_EEPROM = struct.Struct("<I8s")
_NEVER_WRITTEN = b"\xff" * 8


@dataclass(frozen=True, slots=True)
class BoardIdentity:
    """What only the one who built a board knows: the setting of its current limiter, and its id.

    ``current`` A; ``unique_id``: eight bytes. They are the first bytes of its EEPROM. ``board``:
    what its firmware calls it; empty before protocol 1.2.
    """

    current: float
    unique_id: bytes
    board: str = ""

    @classmethod
    def of(cls, info: Info, board: str) -> Self:
        """The identity that the firmware reports."""
        return cls(info.current / 1e6, info.unique_id, board)

    def change(self, current: float | None, name: str | None) -> Self:
        """With what is not None; a board that never had an id gets one."""
        unique_id = self.unique_id if name is None else name.encode().ljust(8, b"\0")
        if unique_id == _NEVER_WRITTEN:
            unique_id = secrets.token_bytes(8)
        return replace(
            self, current=self.current if current is None else current, unique_id=unique_id
        )

    def pack(self) -> bytes:
        """As the firmware reads it: µA, then the id."""
        return _EEPROM.pack(round(self.current * 1e6), self.unique_id)


def sense_resistor(current: float) -> float:
    """Ω that set a board's limiter to ``current`` A."""
    return _REFERENCE / current


def check_current(current: float, of_skin: float | None) -> None:
    """SourceError when ``current`` is none, or above what board and skin may carry, A."""
    limits = {"the board's parts": MOST_CURRENT, "the skin": of_skin or MOST_CURRENT}
    for who, most in limits.items():
        if not 1e-6 <= current <= most:
            raise SourceError(
                f"expected a current of 1 µA to {most * 1e3:g} mA, which is what {who} may "
                f"carry, got {current * 1e3:g} mA",
                where="firmware configure",
                hint=f"fit a sense resistor of {sense_resistor(most):.4g} Ω or more, then say the "
                "current that it gives",
            )


def write_firmware(port: str, channels: int) -> None:
    """Write the firmware of a board with ``channels`` to the one at ``port``; SourceError."""
    _need_avrdude()
    image = firmware_image(channels)
    _avrdude(port, "-U", f"flash:w:{image}:{'e' if image.suffix == '.elf' else 'i'}")


def write_identity(port: str, identity: BoardIdentity) -> None:
    """Write the EEPROM of the board at ``port``, and hear from its firmware that it holds it.

    avrdude's own check is off: the bootloader of most boards reads EEPROMs from a wrong place, and
    the oldest ones do not write them.

    Raises
    ------
    SourceError
        When avrdude fails, or the firmware then says something else.
    """
    with tempfile.TemporaryDirectory(prefix="tomoskin-") as folder:
        file = Path(folder) / "eeprom"
        file.write_bytes(identity.pack())
        _avrdude(port, "-V", "-U", f"eeprom:w:{file}:r")
    held = read_identity(port)
    if held.pack() != identity.pack():
        raise SourceError(
            f"wrote {say_identity(identity)}, but the firmware reads {say_identity(held)}",
            where=port,
            hint="old bootloaders do not write EEPROMs: bring it up to date, or use a programmer",
        )


def read_identity(port: str) -> BoardIdentity:
    """What the firmware at ``port`` says; SourceError where none answers."""
    transport = SerialTransport(port)
    try:
        info = ask_info(transport)
        return BoardIdentity.of(info, _ask_name(transport, info))
    finally:
        transport.close()


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


def _ask_name(transport: Transport, info: Info) -> str:
    if info.minor < BOARDS_SINCE:
        return ""
    board = Exchange(transport).ask(GetBoard(0), BoardLimits)
    return board.text if board else ""


def say_board(identity: BoardIdentity) -> str:
    """``Raspberry Pi Pico, 100 mA, id left-arm (6c6566742d61726d)``."""
    return ", ".join(filter(None, (identity.board, say_identity(identity))))


def say_identity(identity: BoardIdentity) -> str:
    """``100 mA, id left-arm (6c6566742d61726d)``."""
    text = identity.unique_id.rstrip(b"\0")
    name = f"{text.decode()} " if text.isascii() and text.decode().isprintable() else ""
    number = f"({identity.unique_id.hex()})" if name.strip() else identity.unique_id.hex()
    return f"{identity.current * 1e3:g} mA, id {name}{number}"


def _need_avrdude() -> None:
    if shutil.which("avrdude") is None:
        hint = "on Debian: apt-get install avrdude"
        raise SourceError("avrdude is missing", where="firmware", hint=hint)


def _avrdude(port: str, *words: str) -> None:
    _need_avrdude()
    SerialTransport(port).close()  # before one that is absent, avrdude waits for ever
    where = f"avrdude, {port}"
    try:
        done = subprocess.run(
            [*_AVRDUDE, port, *words],
            capture_output=True,
            text=True,
            check=False,
            timeout=_LONGEST,
        )
    except subprocess.TimeoutExpired:
        raise SourceError(f"nothing after {_LONGEST:.0f} s", where=where, hint=_HINT) from None
    if done.returncode:
        said = "; ".join(line.strip() for line in done.stderr.splitlines() if line.strip())
        raise SourceError(
            f"could not write: {said or 'it did not say why'}",
            where=where,
            hint=_HINT,
        )
