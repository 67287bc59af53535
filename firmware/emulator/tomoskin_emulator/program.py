"""The firmware and the emulator that runs it: built from ``firmware``, or as the wheel holds it."""

from __future__ import annotations

import fcntl
import os
import shutil
import struct
import subprocess
import sys
import tty
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from tomoskin.board.source import BOARDS, BoardRecord, FirmwareFiles
from tomoskin.core import SourceError, written
from tomoskin_emulator.board_process import BoardPrograms

FOLDER = Path(__file__).resolve().parents[2]
"""Where the sources are, in a checkout."""

IMAGES = Path(__file__).parent / "images"
"""Where a wheel has the firmware, built: ``tomoskin-8.hex`` for a board with 8 channels."""

BUILD = FOLDER.parent / "build" / "firmware"
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

_NODE_EMULATOR = FOLDER / "pico" / "emulator" / "main.mjs"
_NODE_SET_UP = FOLDER.parent / "scripts" / "pico.py"
_LONGEST = 300.0
_NO_SOURCES = "the firmware's sources are not here"


@dataclass(frozen=True, slots=True)
class Programs:
    """``elf`` for an ATmega2560; ``emulator`` runs it."""

    elf: Path
    emulator: Path

    def power_on(
        self, options: Sequence[str | Path], stderr: IO[bytes]
    ) -> tuple[subprocess.Popen[bytes], str]:
        """See :class:`BoardPrograms`; options as in ``firmware/emulator/emulator.c``."""
        process = _started([self.emulator, *options, self.elf], stderr)
        assert process.stdout is not None
        return process, process.stdout.readline().decode().strip()


@dataclass(frozen=True, slots=True)
class PicoPrograms:
    """``image``, a UF2, for an RP2040; ``node`` runs the emulator that runs it."""

    image: Path
    node: Path

    def power_on(
        self, options: Sequence[str | Path], stderr: IO[bytes]
    ) -> tuple[subprocess.Popen[bytes], str]:
        """See :class:`BoardPrograms`; options as in ``firmware/pico/emulator/main.mjs``."""
        line, port = os.openpty()
        tty.setraw(port)
        os.set_blocking(line, False)
        name = os.ttyname(port)
        words = [self.node, _NODE_EMULATOR, "-p", str(line), *options, self.image]
        process = _started(words, stderr, line, port)  # with its port open the line stays up
        os.close(line)
        os.close(port)
        assert process.stdout is not None
        return process, name if process.stdout.readline() else ""


def _started(words: Sequence[str | Path], stderr: IO[bytes], *fds: int) -> subprocess.Popen[bytes]:
    pipe = subprocess.PIPE
    return subprocess.Popen(words, stdin=pipe, stdout=pipe, stderr=stderr, pass_fds=fds)


def programs_of(board: str) -> BoardPrograms:
    """Firmware and emulator of one of ``BOARDS``, built if they are not up to date.

    Raises
    ------
    SourceError
        When this is no checkout, a tool is missing, the build fails, or nothing runs this board.
    """
    record = BOARDS[board]
    if record.emulator not in _EMULATORS:
        raise SourceError(
            f"there is no emulator of the {record.text}",
            where="emulator",
            hint=f"twin:board={board} has its converter and its speed",
        )
    return _EMULATORS[record.emulator](build_firmware(record, record.channels[-1]))


def _simavr(elf: Path) -> Programs:
    make_firmware(("make", "cc"), "make gcc libsimavr-dev libelf-dev", "emulator")
    return Programs(elf, BUILD / "tomoskin-emulator")


def _rp2040js(uf2: Path) -> PicoPrograms:
    """Node, with the emulator's package installed beside it."""
    if not _NODE_SET_UP.is_file():
        raise SourceError(_NO_SOURCES, where="firmware", hint="use a git checkout")
    done = run_tool([sys.executable, _NODE_SET_UP], _LONGEST)
    if done.returncode:
        lines = done.stderr.strip().splitlines() or ["it did not say why"]
        raise SourceError(lines[0], where="firmware", hint="on Debian: apt-get install nodejs npm")
    return PicoPrograms(uf2, Path(done.stdout.strip()))


_EMULATORS: dict[str, Callable[[Path], BoardPrograms]] = {
    "simavr": _simavr,
    "rp2040js": _rp2040js,
}
"""What makes an emulator ready, by the name that a board's record gives it."""


def pack_uf2(image: bytes, address: int = FLASH) -> bytes:
    """The UF2 that puts ``image`` at ``address``."""
    pages = [image[at : at + PAGE] for at in range(0, len(image), PAGE)]
    return b"".join(
        _HEAD.pack(*_MAGIC, _HAS_FAMILY, address + PAGE * k, PAGE, k, len(pages), RP2040)
        + page.ljust(_BLOCK - _HEAD.size - len(_END), b"\0")
        + _END
        for k, page in enumerate(pages)
    )


def build_firmware(record: BoardRecord, channels: int) -> Path:
    """The firmware of a board with ``channels``, built if it is not up to date; SourceError.

    For a board that is flashed through a drive it is a UF2.
    """
    files = _files(record)
    _make(record, files.make, channels)
    program = BUILD / files.program.format(channels)
    if not program.is_file():
        raise SourceError(
            f"the rule {files.make} made no {program.name}",
            where="firmware",
            hint="the board.mk of the board says how it is made",
        )
    if record.flash != "uf2":
        return program
    data, uf2 = pack_uf2(program.read_bytes()), program.with_suffix(".uf2")
    if not uf2.is_file() or uf2.read_bytes() != data:
        with written(uf2, overwrite=True) as part:
            part.write_bytes(data)
    return uf2


def firmware_image(record: BoardRecord, channels: int) -> Path:
    """What is written to a board: built from the sources in a checkout, else the wheel's image.

    Raises
    ------
    SourceError
        When it cannot be built, or the wheel was made where it could not be.
    """
    files, in_checkout = _files(record), (FOLDER / "Makefile").is_file()
    if in_checkout:
        _make(record, files.make_image, channels)
    image = (BUILD if in_checkout else IMAGES) / files.image.format(channels)
    if not image.is_file():
        raise SourceError(
            "this installation holds no firmware", where="firmware", hint="use a git checkout"
        )
    return image


def _files(record: BoardRecord) -> FirmwareFiles:
    if record.firmware is None:
        raise SourceError(f"there is no firmware for the {record.text}", where="firmware")
    return record.firmware


def _make(record: BoardRecord, target: str, channels: int) -> None:
    files = _files(record)
    needed, packages = ("make", *files.needs), f"make {files.packages}"
    make_firmware(needed, packages, target, f"CHANNELS={channels}")


def run_tool(words: Sequence[str | Path], longest: float) -> subprocess.CompletedProcess[str]:
    """Run a program for at most ``longest`` s; what it said and its exit status."""
    return subprocess.run(words, capture_output=True, text=True, check=False, timeout=longest)


@contextmanager
def build_alone() -> Iterator[None]:
    """Wait until no other process builds the firmware: two would write over each other."""
    BUILD.mkdir(parents=True, exist_ok=True)
    with (BUILD / ".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


def make_firmware(needed: Sequence[str], packages: str, *arguments: str) -> None:
    """Run make in ``firmware``, which needs the programs ``needed`` of Debian's ``packages``.

    Raises SourceError when this is no checkout, a program is missing, or the build fails.
    """
    hint = f"on Debian: apt-get install {packages}"
    if not FOLDER.is_dir():
        raise SourceError(
            _NO_SOURCES,
            where="firmware",
            hint="use a git checkout; tomoskin firmware flash needs none",
        )
    absent = [tool for tool in needed if shutil.which(tool) is None]
    if absent:
        raise SourceError(f"{', '.join(absent)} missing", where="firmware", hint=hint)
    with build_alone():
        made = run_tool(["make", "--silent", "-C", FOLDER, *arguments], _LONGEST)
    if made.returncode:
        lines = [line for line in made.stderr.splitlines() if "error" in line or "***" in line]
        raise SourceError(
            f"the build failed: {lines[0] if lines else made.stderr}",
            where="firmware",
            hint=f"make -C firmware {' '.join(arguments)} says all",
        )
