"""What is written into a board: its firmware, and by avrdude what the board is."""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from pathlib import Path

from tomoskin.board.source import BOARDS_SINCE, BoardRecord, Exchange, SerialTransport, Transport
from tomoskin.board.wire import BoardLimits, GetBoard, GetInfo, Info
from tomoskin.core import SourceError
from tomoskin.twin.emulator.board_process import BoardIdentity
from tomoskin.twin.emulator.program import firmware_image, run_tool
from tomoskin.twin.emulator.uf2 import find_boot_drive, pack_uf2, write_uf2

_REFERENCE = 1.225
"""V across the board's sense resistor."""

_LONGEST = 60.0
_HINT = "is it the board's port, and does nothing else use it?"
_AGAIN, _TRIES = 0.5, 10


def sense_resistor(current: float) -> float:
    """Ω that set a board's limiter to ``current`` A."""
    return _REFERENCE / current


def check_current(current: float, record: BoardRecord, of_skin: float | None) -> None:
    """SourceError when ``current`` is none, or above what board and skin may carry, A."""
    limits = {"the board's parts": record.current, "the skin": of_skin or record.current}
    for who, most in limits.items():
        if not 1e-6 <= current <= most:
            raise SourceError(
                f"expected a current of 1 µA to {most * 1e3:g} mA, which is what {who} may "
                f"carry, got {current * 1e3:g} mA",
                where="firmware configure",
                hint=f"fit a sense resistor of {sense_resistor(most):.4g} Ω or more, then say the "
                "current that it gives",
            )


def write_firmware(record: BoardRecord, channels: int, place: str | None) -> str:
    """Write the firmware of a board with ``channels`` to its port or boot drive; which it was.

    Raises
    ------
    SourceError
        When there is no such place, the firmware cannot be built, or it cannot be written.
    """
    if record.flash == "uf2":
        drive = find_boot_drive() if place is None else Path(place)
        write_uf2(pack_uf2(firmware_image(record, channels).read_bytes()), drive)
        return str(drive)
    if record.flash != "avrdude" or place is None:
        raise SourceError(
            f"nothing here flashes the {record.text}"
            if place
            else "expected the port of the board, such as /dev/ttyACM0, got none",
            where="firmware flash",
        )
    _need_avrdude()
    _avrdude(record, place, "-U", f"flash:w:{firmware_image(record, channels)}:i")
    return place


def write_identity(record: BoardRecord, port: str, identity: BoardIdentity) -> None:
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
        _avrdude(record, port, "-V", "-U", f"eeprom:w:{file}:r")
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
    """``100 mA, id left-arm (6c6566742d61726d)``, or that what it holds is damaged."""
    if identity.damaged:
        return "a current and an id that are damaged (their checksum is wrong): --current sets them"
    text = identity.unique_id.rstrip(b"\0")
    name = f"{text.decode()} " if text.isascii() and text.decode().isprintable() else ""
    number = f"({identity.unique_id.hex()})" if name.strip() else identity.unique_id.hex()
    return f"{identity.current * 1e3:g} mA, id {name}{number}"


def _need_avrdude() -> None:
    if shutil.which("avrdude") is None:
        hint = "on Debian: apt-get install avrdude"
        raise SourceError("avrdude is missing", where="firmware", hint=hint)


def _avrdude(record: BoardRecord, port: str, *words: str) -> None:
    _need_avrdude()
    SerialTransport(port).close()  # before one that is absent, avrdude waits for ever
    where = f"avrdude, {port}"
    try:
        options = ("-q", "-q", *record.avrdude.split(), "-D", "-P", port)
        done = run_tool(["avrdude", *options, *words], _LONGEST)
    except subprocess.TimeoutExpired:
        raise SourceError(f"nothing after {_LONGEST:.0f} s", where=where, hint=_HINT) from None
    if done.returncode:
        complaint = "; ".join(line.strip() for line in done.stderr.splitlines() if line.strip())
        raise SourceError(
            f"could not write: {complaint or 'it did not say why'}",
            where=where,
            hint=_HINT,
        )
