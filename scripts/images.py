"""The firmware as a wheel holds it: images of each board whose compiler is here.

Standard library only, for the build hook.
"""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

from page import digest_of

BOARDS = (
    ("avr-gcc", "image", "tomoskin-{}.hex", (8, 16)),
    ("arm-none-eabi-gcc", "pico", "tomoskin-pico-{}.bin", (8, 16, 32)),
)
"""Compiler, target of firmware/Makefile, what it makes by channels, and the channels."""


class ImageError(Exception):
    """No images; the message says why."""


def build(root: Path) -> None:
    """Build the images of the source tree at ``root``, unless they are those of its sources.

    Raises
    ------
    ImageError
        When a build fails, or a compiler is missing: the other boards' images are there, stale
        ones are removed.
    """
    folder, firmware = root / "src" / "tomoskin" / "twin" / "emulator" / "images", root / "firmware"
    sources = [
        firmware / "Makefile",
        *sorted(firmware.glob("src/*")),
        *sorted(firmware.glob("avr/*")),
        *sorted(firmware.glob("pico/*.*")),
    ]
    stamp, digest = folder / "sources.sha256", digest_of(root, sources)
    if stamp.is_file() and stamp.read_text(encoding="utf-8") == digest:
        return
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    absent = [compiler for compiler, *_ in BOARDS if shutil.which(compiler) is None]
    for compiler, target, name, sizes in BOARDS:
        for channels in sizes if compiler not in absent else ():
            _make(firmware, target, channels)
            shutil.copy(root / "build" / "firmware" / name.format(channels), folder)
    if absent:
        raise ImageError(f"its boards' images are not in it: {' and '.join(absent)} missing")
    stamp.write_text(digest, encoding="utf-8")


def _make(firmware: Path, target: str, channels: int) -> None:
    if shutil.which("make") is None:
        raise ImageError("make is missing")
    made = subprocess.run(
        ["make", "--silent", "-C", str(firmware), target, f"CHANNELS={channels}"],
        env={**os.environ, "MAKEFLAGS": ""},
        capture_output=True,
        text=True,
        check=False,
    )
    if made.returncode:
        raise ImageError(f"the build failed: {made.stderr.strip()[-500:]}")
