"""Where a skin's text comes from: the built-in skins, or a file."""

from __future__ import annotations

from importlib.resources import files
from os import PathLike, fspath
from pathlib import Path

from tomoskin.core import (
    EMPTY,
    SkinError,
    StrPath,
    meant,
    open_input,
    registered,
    registered_one,
)

BUILT_IN = "built-in"
"""Source of the skins that come with tomoskin."""

_LARGEST = 1_000_000
"""A skin file has at most so many bytes."""


def built_in_names() -> tuple[str, ...]:
    """Names of the built-in skins and of those that are registered, sorted."""
    folder = files("tomoskin.model.skin") / "builtin"
    names = [entry.name.removesuffix(".toml") for entry in folder.iterdir()]
    ours = (name for name in names if not name.startswith("_"))
    return tuple(sorted({*ours, *registered("skins")}))


def skin_text(skin: str | PathLike[str]) -> tuple[str, str]:
    """Text and source of the built-in skin or file.

    Raises SkinError when there is neither, or the file cannot be read as text.
    """
    if isinstance(skin, str) and skin in built_in_names():
        entry = files("tomoskin.model.skin") / "builtin" / f"{skin}.toml"
        if (added := registered_one("skins", skin)) is not None:
            entry = added.load()
        return entry.read_text(encoding="utf-8"), BUILT_IN
    path = Path(fspath(skin))
    try:
        return read_text(path, "a skin file", _LARGEST), str(path)
    except SkinError as error:
        if error.message != "there is no such file":
            raise
        names = built_in_names()
        guess = meant(str(path), names).removeprefix("; ")
        raise SkinError(
            "there is no such file, and no built-in skin of that name",
            where=str(path),
            hint=f"{guess} built-in skins: {', '.join(names)}".strip(),
        ) from None


def read_text(path: StrPath, what: str, most: int = 10_000_000) -> str:
    """Text of ``what`` a person has written, of at most so many bytes.

    Raises SkinError for what is no such file, and what cannot be read as text.
    """
    where = str(path)
    with open_input(path, error=SkinError, what=what) as file:
        data = file.read(most + 1)
    if len(data) > most:
        raise SkinError(f"is too large for {what} (over {most / 1e6:g} MB)", where=where)
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise SkinError(
            f"is not a text file (byte {error.start} is not UTF-8)", where=where
        ) from None
    if not text.strip():
        raise SkinError(EMPTY, where=where)
    return text
