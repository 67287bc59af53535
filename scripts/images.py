"""The firmware as a wheel holds it: images of each board whose compiler is here.

Standard library only, for the build hook.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import tomllib
from pathlib import Path

from page import digest_of


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
    firmware = root / "firmware"
    folder = firmware / "emulator" / "tomoskin_emulator" / "images"
    table = root / "src" / "tomoskin" / "board" / "source" / "boards.toml"
    boards = [
        board for board in tomllib.loads(table.read_text("utf-8")).values() if "firmware" in board
    ]
    names = ["src/*", *(f"{board['firmware']['folder']}/*.*" for board in boards)]
    sources = [table, firmware / "Makefile", *(f for n in names for f in sorted(firmware.glob(n)))]
    stamp, digest = folder / "sources.sha256", digest_of(root, sources)
    if stamp.is_file() and stamp.read_text(encoding="utf-8") == digest:
        return
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    compilers = {board["text"]: board["firmware"]["needs"][0] for board in boards}
    absent = [compiler for compiler in compilers.values() if shutil.which(compiler) is None]
    for board in boards:
        files = board["firmware"]
        for channels in board["channels"] if compilers[board["text"]] not in absent else ():
            _make(firmware, files["make_image"], channels)
            shutil.copy(root / "build" / "firmware" / files["image"].format(channels), folder)
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
