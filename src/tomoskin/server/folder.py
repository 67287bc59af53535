"""The session folder: files by their names alone, so that no page reaches beyond it."""

from __future__ import annotations

import re
import tomllib
from dataclasses import dataclass
from itertools import count
from pathlib import Path

from msgspec.structs import replace

from tomoskin.core import DataError, write_text
from tomoskin.server.page_messages import FileEntry
from tomoskin.server.requests import MOST_NOTES, NAME, STEM

KINDS = {
    ".mcap": "session",
    ".toml": "skin",
    ".npz": "numbers",
    ".csv": "numbers",
    ".parquet": "numbers",
    ".h5": "numbers",
    ".mat": "numbers",
    ".png": "picture",
    ".gif": "picture",
}
"""What is listed and handed out, by the ending of its name."""

SESSION, SKIN = ".mcap", ".toml"

_OF_SKINS = {"outline", "electrodes"}
"""Sections that every skin file has."""

_MOST_SETTINGS = 1 << 20
"""Bytes of a file of settings that is looked into."""

MOST_FILES = 200

NOTES = ".notes.txt"
"""What a person wrote about a session stands beside it, under its stem and this ending."""


@dataclass(frozen=True, slots=True)
class Folder:
    """Files of one folder; neither those of others in it nor what links lead to."""

    path: Path

    def list_files(self) -> tuple[tuple[FileEntry, ...], int]:
        """At most :data:`MOST_FILES`, the newest first, and how many others of their kinds are not
        handed out: too many, or with names that no page may ask for.

        Raises DataError where the folder cannot be read.
        """
        entries, others = [], 0
        try:
            for path in self.path.iterdir():
                if path.suffix not in KINDS or not path.is_file() or path.is_symlink():
                    continue
                if path.suffix == SKIN and not _is_skin(path, or_robot=True):
                    continue
                if not _is_offered(path.name):
                    others += 1
                    continue
                about = path.stat()
                entries.append(
                    FileEntry(
                        name=path.name,
                        kind=KINDS[path.suffix],
                        size=about.st_size,
                        written=about.st_mtime,
                    )
                )
        except OSError as error:
            raise DataError(
                f"cannot be read: {error.strerror}", where="the session folder"
            ) from error
        newest = sorted(entries, key=lambda file: -file.written)
        listed = tuple(replace(file, notes=self._notes(file)) for file in newest[:MOST_FILES])
        return listed, others + len(newest[MOST_FILES:])

    def _notes(self, file: FileEntry) -> str:
        path = self._notes_path(file.name)
        if file.kind != "session" or path.is_symlink() or not path.is_file():
            return ""
        return path.read_bytes()[: 4 * MOST_NOTES].decode(errors="replace")[:MOST_NOTES]

    def _notes_path(self, name: str) -> Path:
        return self.path / f"{Path(name).stem}{NOTES}"

    def annotate(self, name: str, text: str) -> None:
        """Write notes on a session beside it, in place of older ones; none for "".

        Raises DataError where there is no such session, and OutputError where notes cannot be
        written.
        """
        self.existing(name, SESSION)
        path = self._notes_path(name)
        if path.is_symlink():
            raise DataError(
                "is a link; tomoskin does not write through links: remove it first", where=path.name
            )
        if text.strip():
            write_text(path, text.strip() + "\n", overwrite=True)
        else:
            path.unlink(missing_ok=True)

    def rename(self, name: str, stem: str) -> str:
        """Give a session and its notes another name; the new one. Never over another file.

        Raises DataError where there is no such session or the new name is taken.
        """
        path, old = self.existing(name, SESSION), self._notes_path(name)
        new = self.path / self._check(f"{stem}{SESSION}")
        moves = [(path, new)] + ([(old, self._notes_path(new.name))] if old.is_file() else [])
        for _, target in moves:
            if target.exists() or target.is_symlink():
                raise DataError("exists already: choose another name", where=target.name)
        try:
            for source, target in moves:
                source.rename(target)
        except OSError as error:
            raise DataError(f"cannot be renamed: {error.strerror}", where=name) from error
        return new.name

    def delete(self, name: str) -> None:
        """Delete a session and its notes. Raises DataError where there is no such session."""
        path = self.existing(name, SESSION)
        try:
            path.unlink()
            self._notes_path(name).unlink(missing_ok=True)
        except OSError as error:
            raise DataError(f"cannot be deleted: {error.strerror}", where=name) from error

    def skins(self) -> list[str]:
        """Stems of the skin files that a page may ask for, in the order of the alphabet."""
        named = (path for path in self.path.glob(f"*{SKIN}") if re.fullmatch(STEM, path.stem))
        return sorted(path.stem for path in named if _is_skin(path))[:MOST_FILES]

    def existing(self, name: str, *endings: str) -> Path:
        """A file of this folder by its name; DataError where there is none that may be had."""
        path = self.path / self._check(name)
        if endings and path.suffix not in endings:
            raise DataError(f"expected a name that ends in {' or '.join(endings)}, got {name}")
        if path.is_symlink() or not path.is_file():
            raise DataError("there is no such file in the session folder", where=name)
        return path

    def free(self, stem: str, ending: str) -> Path:
        """A name that is not taken: ``stem`` and, where it must be, a number. DataError."""
        for number in count(1):
            path = self.path / self._check(f"{stem}{f'-{number}' if number > 1 else ''}{ending}")
            if not path.exists() and not path.is_symlink():
                return path
        raise AssertionError

    @staticmethod
    def _check(name: str) -> str:
        if not _is_offered(name):
            raise DataError(f"expected the name of a file, without a folder, got {repr(name)[:80]}")
        return name


def _is_skin(path: Path, *, or_robot: bool = False) -> bool:
    """Whether a TOML file has the sections of a skin, or those of a robot."""
    try:
        if path.stat().st_size > _MOST_SETTINGS:
            return False
        document = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return False
    is_robot = isinstance(document.get("skin"), list)
    return document.keys() >= _OF_SKINS or (or_robot and is_robot)


def _is_offered(name: str) -> bool:
    return re.fullmatch(NAME, name) is not None and Path(name).suffix in KINDS
