"""The firmware of a Raspberry Pi Pico, what runs it here, and its boot drive."""

from __future__ import annotations

import os
import struct
import subprocess
import sys
import tty
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from tomoskin.core import SourceError, StrPath, written
from tomoskin.twin.emulator.program import BUILD, FOLDER, IMAGES, make_firmware
from tomoskin.twin.emulator.uf2 import FLASH, PAGE, check_boot, pack_uf2, unpack_uf2

ADC_BITS = 12
CHANNELS = (8, 16, 32)
"""That the firmware is built for; what is emulated has the most."""

_EMULATOR = FOLDER / "pico" / "emulator" / "main.mjs"
_SET_UP = FOLDER.parent / "scripts" / "pico.py"
_NEEDED = ("make", "arm-none-eabi-gcc", "arm-none-eabi-objcopy", "arm-none-eabi-size")
_PACKAGES = "make gcc-arm-none-eabi libnewlib-arm-none-eabi"
_MOUNTS = ("/media", "/run/media", "/Volumes", "/mnt")
_ABOUT, _WRITTEN = "INFO_UF2.TXT", "tomoskin.uf2"
_LONGEST = 300.0
_SETTINGS = 0x1FF000
"""Of the flash's last sector: ``firmware/pico/flash.c``."""


@dataclass(frozen=True, slots=True)
class PicoPrograms:
    """``image``, a UF2, for the board; ``node`` runs the emulator that runs it."""

    image: Path
    node: Path

    def power_on(
        self, options: Sequence[str | Path], said: IO[bytes]
    ) -> tuple[subprocess.Popen[bytes], str]:
        """The emulator's process, and the board's serial port; empty when it does not start.

        ``options``: as in ``firmware/pico/emulator/main.mjs``; ``said``: what takes its stderr.
        """
        line, port = os.openpty()
        tty.setraw(port)
        os.set_blocking(line, False)
        name = os.ttyname(port)
        process = subprocess.Popen(
            [self.node, _EMULATOR, "-p", str(line), *options, self.image],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=said,
            pass_fds=(line, port),  # with its port open the line stays up without a host
        )
        os.close(line)
        os.close(port)
        assert process.stdout is not None
        return process, name if process.stdout.readline() else ""


def build_uf2(channels: int) -> Path:
    """The firmware of a Pico with ``channels``, built if it is not up to date; SourceError."""
    data = pico_image(channels)
    uf2 = BUILD / f"tomoskin-pico-{channels}.uf2"
    if not uf2.is_file() or uf2.read_bytes() != data:
        with written(uf2, overwrite=True) as part:
            part.write_bytes(data)
    return uf2


def pico_image(channels: int) -> bytes:
    """The UF2 for a Pico: built in a checkout, else of the wheel's image; SourceError."""
    name = f"tomoskin-pico-{channels}.bin"
    if FOLDER.is_dir():
        make_firmware(_NEEDED, _PACKAGES, "pico", f"CHANNELS={channels}")
    image = (BUILD if FOLDER.is_dir() else IMAGES) / name
    if not image.is_file():
        raise SourceError(
            "this installation holds no firmware", where="firmware", hint="use a git checkout"
        )
    check_boot(image.read_bytes(), str(image))
    return pack_uf2(image.read_bytes())


def build_pico_programs() -> PicoPrograms:
    """Firmware and emulator, built if they are not up to date.

    Raises
    ------
    SourceError
        When this is no checkout, the compiler or Node is missing, or the build fails.
    """
    return PicoPrograms(build_uf2(CHANNELS[-1]), _find_node())


def settings_uf2(current: float) -> bytes:
    """The UF2 that says what a Pico's current limiter is set to, A; its firmware stays."""
    page = struct.pack("<I", round(current * 1e6)).ljust(PAGE, b"\xff")
    return pack_uf2(page, FLASH + _SETTINGS)


def write_uf2(uf2: bytes, drive: StrPath) -> None:
    """Write ``uf2`` to the boot ``drive`` of a Pico; SourceError when either is another's."""
    drive = Path(drive)
    unpack_uf2(uf2, "the file")
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


_HINT = "hold BOOTSEL while you plug the Pico in: it shows itself as a drive, RPI-RP2"


def find_boot_drive(roots: Iterable[StrPath] | None = None) -> Path:
    """The boot drive of the only Pico that waits for its firmware.

    Raises
    ------
    SourceError
        When there is none, or more than one.
    """
    tops = [Path(root) for root in (_MOUNTS if roots is None else roots)]
    found = [about.parent for top in tops for depth in _DEPTHS for about in top.glob(depth)]
    drives = [drive for drive in found if "RP2" in _board_of(drive / _ABOUT)]
    if len(drives) != 1:
        names = ", ".join(map(str, drives)) or "none"
        raise SourceError(
            f"expected one boot drive of a Pico, found {names}",
            where="firmware flash",
            hint=f"{_HINT}; or name where it is mounted",
        )
    return drives[0]


_DEPTHS = (_ABOUT, f"*/{_ABOUT}", f"*/*/{_ABOUT}")


def _board_of(about: Path) -> str:
    """What a boot drive calls its board; empty where it is none."""
    try:
        lines = about.read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return ""
    return next((line.partition(":")[2].strip() for line in lines if "Board-ID" in line), "")


def _find_node() -> Path:
    """Node, with the emulator's package installed beside it."""
    if not _SET_UP.is_file():
        raise SourceError(
            "the firmware's sources are not here", where="firmware", hint="use a git checkout"
        )
    done = subprocess.run(
        [sys.executable, _SET_UP], capture_output=True, text=True, check=False, timeout=_LONGEST
    )
    if done.returncode:
        lines = done.stderr.strip().splitlines() or ["it did not say why"]
        raise SourceError(lines[0], where="firmware", hint="on Debian: apt-get install nodejs npm")
    return Path(done.stdout.strip())
