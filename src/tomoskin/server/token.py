"""A token that outlives its server, in a file that only its owner can read."""

from __future__ import annotations

import os
import re
import secrets
import stat
from pathlib import Path

from tomoskin.core import DataError

_TOKEN = re.compile(r"[A-Za-z0-9_-]{32,128}")


def kept_token(path: Path) -> str:
    """The token in ``path``, made there when the file does not exist.

    Raises
    ------
    DataError
        When the file cannot be read or made, holds no token, or others may read it.
    """
    try:
        handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    except FileExistsError:
        return _read(path)
    except OSError as error:
        raise DataError(f"cannot be made: {error.strerror}", where=str(path)) from None
    with os.fdopen(handle, "w") as file:
        token = secrets.token_urlsafe(32)
        file.write(token + "\n")
    return token


def _read(path: Path) -> str:
    try:
        mode = path.stat().st_mode
        text = path.read_text(encoding="ascii").strip()
    except (OSError, UnicodeDecodeError):
        raise DataError("cannot be read", where=str(path)) from None
    if os.name == "posix" and mode & (stat.S_IRWXG | stat.S_IRWXO):
        raise DataError(
            "others may read this file, and with it control the page",
            where=str(path),
            hint=f"chmod 600 {path}",
        )
    if not _TOKEN.fullmatch(text):
        raise DataError(
            "holds no token of this program", where=str(path), hint="name a file that is not there"
        )
    return text
