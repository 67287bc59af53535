"""The session folder: files by their names alone, so that no page reaches beyond it."""

from __future__ import annotations

import re
from dataclasses import dataclass
from itertools import count
from pathlib import Path

from tomoskin.core import DataError

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

MOST_FILES = 200

NAME = r"[A-Za-z0-9][A-Za-z0-9._-]{0,119}"
"""Of a file that a page may ask for: no folder, nothing hidden."""

STEM = r"[A-Za-z0-9][A-Za-z0-9_-]{0,63}"
"""The same without its ending."""


@dataclass(frozen=True, slots=True)
class FileEntry:
    """A file: name, kind, size in bytes, when it was last written (s since 1970)."""

    name: str
    kind: str
    size: int
    written: float


@dataclass(frozen=True, slots=True)
class Listing:
    """Files that are handed out, the newest first, and how many others of their kinds there are."""

    files: tuple[FileEntry, ...]
    others: int


@dataclass(frozen=True, slots=True)
class Folder:
    """Files of one folder; neither those of others in it nor what links lead to."""

    path: Path

    def list_files(self) -> Listing:
        """At most :data:`MOST_FILES`; those with names that no page may ask for are counted.

        Raises DataError where the folder cannot be read.
        """
        entries, others = [], 0
        try:
            for path in self.path.iterdir():
                if path.suffix not in KINDS or not path.is_file() or path.is_symlink():
                    continue
                if not _is_offered(path.name):
                    others += 1
                    continue
                about = path.stat()
                kind = KINDS[path.suffix]
                entries.append(FileEntry(path.name, kind, about.st_size, about.st_mtime))
        except OSError as error:
            raise DataError(f"cannot be read: {error.strerror}", where="the folder") from error
        newest = sorted(entries, key=lambda file: -file.written)
        return Listing(tuple(newest[:MOST_FILES]), others + len(newest[MOST_FILES:]))

    def skins(self) -> list[str]:
        """Stems of the skin files that a page may ask for, in the order of the alphabet."""
        stems = (path.stem for path in self.path.glob("*.toml"))
        return sorted(stem for stem in stems if re.fullmatch(STEM, stem))[:MOST_FILES]

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
            raise DataError("expected the name of a file, without a folder", where=repr(name)[:80])
        return name


def _is_offered(name: str) -> bool:
    return re.fullmatch(NAME, name) is not None and Path(name).suffix in KINDS
