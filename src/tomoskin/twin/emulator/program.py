"""The firmware and the emulator that runs it: built from ``firmware``, or as the wheel holds it."""

from __future__ import annotations

import fcntl
import shutil
import subprocess
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from tomoskin.core import SourceError

FOLDER = Path(__file__).resolve().parents[4] / "firmware"
"""Where the sources are, in a checkout."""

IMAGES = Path(__file__).parent / "images"
"""Where a wheel has the firmware, built: ``tomoskin-8.hex`` for a board with 8 channels."""

CHANNELS = (8, 16)
"""That the firmware is built for; what is emulated has the most."""

BUILD = FOLDER.parent / "build" / "firmware"
_PACKAGES = "make gcc gcc-avr avr-libc libsimavr-dev libelf-dev"
_NEEDED = ("make", "cc", "avr-gcc", "avr-size")
_LONGEST = 300.0


@dataclass(frozen=True, slots=True)
class Programs:
    """``elf`` for the board; ``emulator`` runs it."""

    elf: Path
    emulator: Path

    def power_on(
        self, options: Sequence[str | Path], said: IO[bytes]
    ) -> tuple[subprocess.Popen[bytes], str]:
        """The emulator's process, and the board's serial port; empty when it does not start.

        ``options``: as in ``firmware/emulator/emulator.c``; ``said``: what takes its stderr.
        """
        process = subprocess.Popen(
            [self.emulator, *options, self.elf],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=said,
        )
        assert process.stdout is not None
        return process, process.stdout.readline().decode().strip()


def build_elf(channels: int = CHANNELS[-1]) -> Path:
    """The firmware of a board with ``channels``, built if it is not up to date; SourceError."""
    make_firmware(_NEEDED, _PACKAGES, "avr", f"CHANNELS={channels}")
    return BUILD / f"tomoskin-{channels}.elf"


def firmware_image(channels: int) -> Path:
    """What is written to a board: built from the sources in a checkout, else the wheel's image.

    Raises
    ------
    SourceError
        When it cannot be built, or the wheel was made where it could not be.
    """
    if FOLDER.is_dir():
        return build_elf(channels)
    image = IMAGES / f"tomoskin-{channels}.hex"
    if not image.is_file():
        raise SourceError(
            "this installation holds no firmware", where="firmware", hint="use a git checkout"
        )
    return image


def build_programs() -> Programs:
    """Firmware and emulator, built if they are not up to date.

    Raises
    ------
    SourceError
        When this is no checkout, a tool is missing, or the build fails.
    """
    elf = build_elf()
    make_firmware(_NEEDED, _PACKAGES, "emulator")
    return Programs(elf, BUILD / "tomoskin-emulator")


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
            "the firmware's sources are not here",
            where="firmware",
            hint="use a git checkout; tomoskin firmware flash needs none",
        )
    absent = [tool for tool in needed if shutil.which(tool) is None]
    if absent:
        raise SourceError(f"{', '.join(absent)} missing", where="firmware", hint=hint)
    with build_alone():
        made = subprocess.run(
            ["make", "--silent", "-C", str(FOLDER), *arguments],
            capture_output=True,
            text=True,
            check=False,
            timeout=_LONGEST,
        )
    if made.returncode:
        lines = [line for line in made.stderr.splitlines() if "error" in line] or ["make failed"]
        raise SourceError(f"the build failed: {lines[0]}", where="firmware", hint=hint)
