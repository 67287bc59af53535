"""Files that appear when they are complete: what was there before stays until then."""

from __future__ import annotations

import os
import secrets
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from tomoskin.core.errors import DataError
from tomoskin.core.outputs import Output, StrPath, check_outputs, real_path


@contextmanager
def written(path: StrPath, *, overwrite: bool = False) -> Iterator[Path]:
    """An empty file beside ``path``, of the same ending, that takes its place after the block.

    When the block raises, and at Ctrl-C, it is taken away, and what was at ``path`` stays as it
    was. A link stays a link: the file that it leads to is replaced.

    Raises
    ------
    OutputError
        Before and after the block: as :func:`check_outputs` does.
    DataError
        When the disk refuses.
    """
    path = Path(path)
    check_outputs([Output(path)], overwrite=overwrite)
    target = real_path(path)
    part = target.with_name(f".tomoskin-{secrets.token_hex(8)}{target.suffix}")
    try:
        try:
            os.close(os.open(part, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666))
            yield part
            _settle(part, target)
            check_outputs([Output(path)], overwrite=overwrite)  # the block may have taken hours
            part.replace(target)
        finally:
            part.unlink(missing_ok=True)
    except OSError as error:
        raise DataError(
            f"cannot be written: {error.strerror or error}",
            where=str(path),
            hint="check that the disk is connected and has space",
        ) from error


def write_text(path: StrPath, text: str, *, overwrite: bool = False) -> None:
    """Write ``text`` as UTF-8, complete or not at all; raises as :func:`written` does."""
    with written(path, overwrite=overwrite) as part:
        part.write_text(text, encoding="utf-8", newline="\n")


def _settle(part: Path, target: Path) -> None:
    """On the disk, and readable by those who could read what was there."""
    with part.open("rb+") as file:
        os.fsync(file.fileno())
    if target.exists():
        part.chmod(stat.S_IMODE(target.stat().st_mode))
