"""The firmware as a wheel holds it: an image for each board, built where avr-gcc is.

Standard library only, for the build hook.
"""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

from page import digest_of

CHANNELS = (8, 16)


class ImageError(Exception):
    """No images; the message says why."""


def build(root: Path) -> None:
    """Build the images of the source tree at ``root``, unless they are those of its sources.

    Raises
    ------
    ImageError
        Without avr-gcc, or when the build fails; stale images are removed.
    """
    folder, firmware = root / "src" / "tomoskin" / "emulator" / "images", root / "firmware"
    sources = [
        firmware / "Makefile",
        *sorted(firmware.glob("src/*")),
        *sorted(firmware.glob("avr/*")),
    ]
    stamp, digest = folder / "sources.sha256", digest_of(root, sources)
    if stamp.is_file() and stamp.read_text(encoding="utf-8") == digest:
        return
    shutil.rmtree(folder, ignore_errors=True)
    if shutil.which("avr-gcc") is None or shutil.which("make") is None:
        raise ImageError("avr-gcc or make is missing")
    for channels in CHANNELS:
        made = subprocess.run(
            ["make", "--silent", "-C", str(firmware), "image", f"CHANNELS={channels}"],
            env={**os.environ, "MAKEFLAGS": ""},
            capture_output=True,
            text=True,
            check=False,
        )
        if made.returncode:
            raise ImageError(f"the build failed: {made.stderr.strip()[-500:]}")
    folder.mkdir()
    for channels in CHANNELS:
        shutil.copy(root / "build" / "firmware" / f"tomoskin-{channels}.hex", folder)
    stamp.write_text(digest, encoding="utf-8")
