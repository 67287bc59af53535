"""The map as a film: GIF by Pillow, MP4 by ffmpeg where it is installed."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Iterable
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import DataError, StrPath, needed, written

Pictures = Iterable[NDArray[np.uint8]]


def write_gif(path: StrPath, pictures: Pictures, fps: float, *, overwrite: bool = False) -> None:
    """Write pictures (h, w, 3) as a GIF that repeats.

    Raises
    ------
    DataError
        When Pillow is missing, and as :func:`written` does.
    """
    pillow = needed("PIL.Image", "plot", path)
    images = (pillow.fromarray(figure) for figure in pictures)
    first = next(images)
    with written(path, overwrite=overwrite) as part:
        first.save(part, "GIF", save_all=True, append_images=images, duration=1e3 / fps, loop=0)


def write_mp4(path: StrPath, pictures: Pictures, fps: float, *, overwrite: bool = False) -> None:
    """Write pictures (h, w, 3) as H.264 through ffmpeg.

    Raises
    ------
    DataError
        When there is no ffmpeg or it cannot write the file, and as :func:`written` does.
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
        *("-pix_fmt", "yuv420p", "-vf", "crop=trunc(iw/2)*2:trunc(ih/2)*2"),
    ]
    with written(path, overwrite=overwrite) as part:
        reason = _encoded([*command, str(part)], first, stream)
        if reason:
            raise DataError(f"cannot be written: {reason}", where=str(path))


class Film(Protocol):
    """What writes pictures (h, w, 3) as a film."""

    def __call__(
        self, path: StrPath, pictures: Pictures, fps: float, *, overwrite: bool = False
    ) -> None:
        """Write the film. Raises DataError."""


FILMS: dict[str, Film] = {".gif": write_gif, ".mp4": write_mp4}
"""What writes a film, by the ending of its name."""


def _encoded(command: list[str], first: NDArray[np.uint8], rest: Pictures) -> str:
    """Feed a program; why it failed, or ""."""
    with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        _feed(process, first, rest)
        _, errors = process.communicate()
    if not process.returncode:
        return ""
    text = errors.decode(errors="replace").strip().splitlines()
    return text[-1] if text else f"ffmpeg ended with the code {process.returncode}"


def _feed(process: Any, first: NDArray[np.uint8], rest: Pictures) -> None:
    try:
        process.stdin.write(first.tobytes())
        for figure in rest:
            process.stdin.write(figure.tobytes())
    except BrokenPipeError:
        pass  # it has ended, and says why
