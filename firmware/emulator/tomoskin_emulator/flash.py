"""What is written into a board: its firmware, by avrdude or as UF2 through the boot drive of a
Pico, and by avrdude what the board is."""

from __future__ import annotations

import os
import shutil
import struct
import subprocess
import tempfile
from collections.abc import Iterable
from pathlib import Path

from tomoskin.board.source import (
    BOARDS_SINCE,
    BoardRecord,
    Exchange,
    SerialTransport,
    Transport,
    ask_info,
)
from tomoskin.board.wire import BoardLimits, GetBoard, Info
from tomoskin.core import SourceError, StrPath
from tomoskin_emulator.board_process import BoardIdentity
from tomoskin_emulator.program import FLASH, PAGE, firmware_image, pack_uf2, run_tool

_SETTINGS = 0x1FF000
"""Where the flash's last sector begins: ``firmware/pico/flash.c``."""

_MOUNTS = ("/media", "/run/media", "/Volumes", "/mnt")
_ABOUT, _WRITTEN = "INFO_UF2.TXT", "tomoskin.uf2"
_DEPTHS = (_ABOUT, f"*/{_ABOUT}", f"*/*/{_ABOUT}")
_BOOTSEL = "hold BOOTSEL while you plug the Pico in: it shows itself as a drive, RPI-RP2"


def settings_uf2(current: float) -> bytes:
    """The UF2 that says what a Pico's current limiter is set to, A; its firmware stays."""
    page = struct.pack("<I", round(current * 1e6)).ljust(PAGE, b"\xff")
    return pack_uf2(page, FLASH + _SETTINGS)


def write_uf2(uf2: bytes, drive: StrPath) -> None:
    """Write ``uf2`` to the boot ``drive`` of a Pico; SourceError when it is another's."""
    drive = Path(drive)
    about = drive / _ABOUT
    board = _board_of(about)
    if "RP2" not in board:
        raise SourceError(
            f"expected the boot drive of a Pico (Board-ID RPI-RP2), found {board or 'none'}",
            where=str(drive),
            hint=_BOOTSEL,
        )
    try:
        part = drive / _WRITTEN  # the board takes it as it comes, and nothing is there before
        with part.open("wb") as file:
            file.write(uf2)
            file.flush()
            os.fsync(file.fileno())
    except OSError as error:
        raise SourceError(f"could not write: {error}", where=str(drive), hint=_BOOTSEL) from None


def find_boot_drive(roots: Iterable[StrPath] | None = None) -> Path:
    """The boot drive of the only Pico that waits for its firmware.

    Raises
    ------
    SourceError
        When there is none, or more than one.
    """
    tops = [Path(root) for root in (_MOUNTS if roots is None else roots)]
    folders = [about.parent for top in tops for depth in _DEPTHS for about in top.glob(depth)]
    drives = [drive for drive in folders if "RP2" in _board_of(drive / _ABOUT)]
    if len(drives) != 1:
        names = ", ".join(map(str, drives)) or "none"
        raise SourceError(
            f"expected one boot drive of a Pico, found {names}",
            where="firmware flash",
            hint=f"{_BOOTSEL}; or name where it is mounted",
        )
    return drives[0]


def _board_of(about: Path) -> str:
    """What a boot drive calls its board; empty where it is none."""
    try:
        lines = about.read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return ""
    return next((line.partition(":")[2].strip() for line in lines if "Board-ID" in line), "")


_REFERENCE = 1.225
"""V across the board's sense resistor."""

_LONGEST = 60.0
_HINT = "is it the board's port, and does nothing else use it?"


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
