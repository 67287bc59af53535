"""The firmware and the emulator that runs it: built from ``firmware``, or as the wheel holds it."""

from __future__ import annotations

import fcntl
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from tomoskin.core import SourceError

FOLDER = Path(__file__).resolve().parents[3] / "firmware"
"""Where the sources are, in a checkout."""

IMAGES = Path(__file__).parent / "images"
"""Where a wheel has the firmware, built: ``tomoskin-8.hex`` for a board with 8 channels."""

_BUILD = FOLDER.parent / "build" / "firmware"
_PACKAGES = "make gcc gcc-avr avr-libc libsimavr-dev libelf-dev"
_NEEDED = ("make", "cc", "avr-gcc", "avr-size")
_HINT = f"on Debian: apt-get install {_PACKAGES}"
_LONGEST = 300.0


@dataclass(frozen=True, slots=True)
class Programs:
    """``elf`` for the board; ``emulator`` runs it."""

    elf: Path
    emulator: Path


def build_elf(channels: int = 16) -> Path:
    """The firmware of a board with ``channels``, built if it is not up to date; SourceError."""
    _make("avr", f"CHANNELS={channels}")
    return _BUILD / f"tomoskin-{channels}.elf"


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
    _make("emulator")
    return Programs(elf, _BUILD / "tomoskin-emulator")


@contextmanager
def build_alone() -> Iterator[None]:
    """Wait until no other process builds the firmware: two would write over each other."""
    _BUILD.mkdir(parents=True, exist_ok=True)
    with (_BUILD / ".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


def _make(*arguments: str) -> None:
    if not FOLDER.is_dir():
        raise SourceError(
            "the firmware's sources are not here",
            where="firmware",
            hint="use a git checkout; tomoskin firmware flash needs none",
        )
    absent = [tool for tool in _NEEDED if shutil.which(tool) is None]
    if absent:
        raise SourceError(f"{', '.join(absent)} missing", where="firmware", hint=_HINT)
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
        raise SourceError(f"the build failed: {lines[0]}", where="firmware", hint=_HINT)
