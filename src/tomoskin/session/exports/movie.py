"""The map as a film: GIF by Pillow, MP4 by ffmpeg where it is installed."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import DataError
from tomoskin.session.writer import said_of

Pictures = Iterable[NDArray[np.uint8]]


def write_gif(path: Path, pictures: Pictures, fps: float) -> None:
    """Write pictures (h, w, 3) as a GIF that repeats.

    Raises
    ------
    DataError
        When Pillow is missing or the file cannot be written.
    """
    try:
        from PIL import Image
    except ImportError as error:
        raise DataError(
            "a GIF needs Pillow", where=str(path), hint="pip install 'tomoskin[plot]'"
        ) from error
    images = (Image.fromarray(picture) for picture in pictures)
    first = next(images)
    with said_of(path):
        first.save(path, "GIF", save_all=True, append_images=images, duration=1e3 / fps, loop=0)


def write_mp4(path: Path, pictures: Pictures, fps: float) -> None:
    """Write pictures (h, w, 3) as H.264 through ffmpeg.

    Raises
    ------
    DataError
        When there is no ffmpeg, or it cannot write the file.
    """
    program = shutil.which("ffmpeg")
    if program is None:
        raise DataError(
            "MP4 needs the program ffmpeg, which is not installed",
            where=str(path),
            hint="install ffmpeg, or export to .gif",
        )
    stream = iter(pictures)
    first = next(stream)
    height, width = first.shape[:2]
    command = [
        *(program, "-y", "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgb24"),
        *("-s", f"{width}x{height}", "-r", str(fps), "-i", "-"),
        *("-pix_fmt", "yuv420p", "-vf", "crop=trunc(iw/2)*2:trunc(ih/2)*2", str(path)),
    ]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        _feed(process, first, stream)
        _, said = process.communicate()
    if process.returncode:
        text = said.decode(errors="replace").strip().splitlines()
        reason = text[-1] if text else f"ffmpeg ended with {process.returncode}"
        raise DataError(f"cannot be written: {reason}", where=str(path))


WRITERS: dict[str, Callable[[Path, Pictures, float], None]] = {
    ".gif": write_gif,
    ".mp4": write_mp4,
}
"""What writes a film, by the ending of its name."""


def _feed(process: Any, first: NDArray[np.uint8], rest: Pictures) -> None:
    try:
        process.stdin.write(first.tobytes())
        for picture in rest:
            process.stdin.write(picture.tobytes())
    except BrokenPipeError:
        pass  # it has ended, and says why
