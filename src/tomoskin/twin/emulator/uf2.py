"""UF2, the form in which a Pico takes its firmware through its boot drive: blocks of 256 bytes."""

from __future__ import annotations

import os
import struct
from collections.abc import Iterable
from pathlib import Path

from tomoskin.core import SourceError, StrPath

RP2040 = 0xE48BFF56
"""The family that the RP2040's boot ROM asks for."""

FLASH = 0x10000000
"""Where the flash lies in the RP2040's address space."""

_HEAD = struct.Struct("<8I")
_MAGIC = (0x0A324655, 0x9E5D5157)
_END = struct.pack("<I", 0x0AB16F30)
_HAS_FAMILY = 0x2000
_BLOCK = 512
PAGE = 256
"""Bytes of flash in a block."""

_SETTINGS = 0x1FF000
"""Where the flash's last sector begins: ``firmware/pico/flash.c``."""

_MOUNTS = ("/media", "/run/media", "/Volumes", "/mnt")
_ABOUT, _WRITTEN = "INFO_UF2.TXT", "tomoskin.uf2"
_DEPTHS = (_ABOUT, f"*/{_ABOUT}", f"*/*/{_ABOUT}")
_HINT = "hold BOOTSEL while you plug the Pico in: it shows itself as a drive, RPI-RP2"


def pack_uf2(image: bytes, address: int = FLASH) -> bytes:
    """The UF2 that puts ``image`` at ``address``."""
    pages = [image[at : at + PAGE] for at in range(0, len(image), PAGE)]
    return b"".join(
        _HEAD.pack(*_MAGIC, _HAS_FAMILY, address + PAGE * k, PAGE, k, len(pages), RP2040)
        + page.ljust(_BLOCK - _HEAD.size - len(_END), b"\0")
        + _END
        for k, page in enumerate(pages)
    )


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
            hint=_HINT,
        )
    try:
        part = drive / _WRITTEN  # the board takes it as it comes, and nothing is there before
        with part.open("wb") as file:
            file.write(uf2)
            file.flush()
            os.fsync(file.fileno())
    except OSError as error:
        raise SourceError(f"could not write: {error}", where=str(drive), hint=_HINT) from None


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
            hint=f"{_HINT}; or name where it is mounted",
        )
    return drives[0]


def _board_of(about: Path) -> str:
    """What a boot drive calls its board; empty where it is none."""
    try:
        lines = about.read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return ""
    return next((line.partition(":")[2].strip() for line in lines if "Board-ID" in line), "")
