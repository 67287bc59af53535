"""What may be written where, for every command, the page and the library; and files that appear
when they are complete: what was there before stays until then. Files of a user opened for reading,
and how much of this machine's memory one may take."""

from __future__ import annotations

import csv
import os
import secrets
import stat
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import BinaryIO

from tomoskin.core.errors import DataError, OutputError, TomoskinError

StrPath = str | os.PathLike[str]
"""What every public function takes for a file: its name, or its path."""

MAGIC = b"\x89MCAP0\r\n"
"""What a session file begins with."""

RECORDING = {".mcap": "a recording"}
"""The one ending of session files, which are never written over."""

_ELSE = "choose another name"

_SPACE = "check that the disk is connected and has space"


@dataclass(frozen=True, slots=True)
class Output:
    """A file that is to be written.

    Attributes
    ----------
    endings
        What its name may end in, and what each gives ("": no ending); empty: any name.
    name
        What a person calls it, such as "--out".
    makes_folders
        Folders above it that are not there are made.
    """

    path: Path
    endings: Mapping[str, str] = field(default_factory=dict)
    name: str = ""
    makes_folders: bool = False

    def __post_init__(self) -> None:
        """Accept the path as text too."""
        object.__setattr__(self, "path", Path(self.path))


def check_outputs(
    outputs: Iterable[Output],
    inputs: Iterable[StrPath] = (),
    *,
    overwrite: bool = False,
    consent: str = "overwrite=True",
) -> None:
    """Refuse outputs that would replace what must stay, or that cannot be written.

    An input, a session file, and what is no regular file are never written over; any other file
    that is there only with ``overwrite``. Two outputs are two files. Nothing is made or changed.

    Parameters
    ----------
    inputs
        What is read while the outputs are made; may be missing.
    overwrite
        Files that are there may be replaced.
    consent
        How a person says so, for the message; "" where it cannot be said.

    Raises
    ------
    OutputError
        For the first output with a fault.
    """
    wanted, read = list(outputs), list(map(Path, inputs))
    for number, output in enumerate(wanted):
        fault = (
            _fault_of_others(output, wanted[:number], read)
            or _fault_of_what_is_there(output.path, overwrite, consent)
            or _fault_of_ending(output)
            or _fault_of_folder(output)
        )
        if fault:
            message, hint = fault
            raise OutputError(message, where=f"{output.name} {output.path}".strip(), hint=hint)


def is_same_file(one: Path, other: Path) -> bool:
    """Whether two names mean one file: by links, by spelling, or by case, which some disks ignore.

    Neither needs to be there.
    """
    with suppress(OSError):  # one of them is not there
        if one.samefile(other):
            return True
    one, other = real_path(one), real_path(other)
    if one.name.casefold() != other.name.casefold():
        return False
    with suppress(OSError):
        return one.parent == other.parent or one.parent.samefile(other.parent)
    return False


def real_path(path: Path) -> Path:
    """Without links and relative steps; OutputError where the folder that we are in is gone."""
    try:
        return Path(os.path.realpath(path))
    except OSError as error:
        message = f"cannot be read: {error.strerror}"
        raise OutputError(message, where=str(path), hint="choose another folder") from error


Fault = tuple[str, str] | None
"""What was expected and found, and what to do."""


def _fault_of_others(output: Output, before: Sequence[Output], inputs: Sequence[Path]) -> Fault:
    for path in inputs:
        if is_same_file(output.path, path):
            return f"is also the input {path}, and an input is never overwritten", _ELSE
    for other in before:
        if is_same_file(output.path, other.path):
            named = f"{other.name} {other.path}".strip()
            return f"is the same file as {named}", "give each its own name"
    return None


def _fault_of_what_is_there(path: Path, overwrite: bool, consent: str) -> Fault:
    try:
        mode = path.stat().st_mode
        is_recording = stat.S_ISREG(mode) and _is_recording(path)
    except (FileNotFoundError, NotADirectoryError):
        return None
    except OSError as error:
        return f"cannot be read: {error.strerror}", _ELSE
    if not stat.S_ISREG(mode):
        kind = "folder" if stat.S_ISDIR(mode) else "device or pipe"
        return f"expected the name of a file, got a {kind}", "name a file"
    if is_recording:
        return "exists already, and a recording is never overwritten", _ELSE
    if not overwrite:
        return "exists already", f"{_ELSE}, or overwrite it: {consent}" if consent else _ELSE
    writable = os.access(path, os.W_OK)
    return None if writable else ("exists already and is write-protected", _ELSE)


def _fault_of_ending(output: Output) -> Fault:
    endings = output.endings
    if not endings or output.path.suffix.lower() in endings:
        return None
    named = ", ".join(f"{end or 'no ending'} ({gives})" for end, gives in endings.items())
    return f"expected a name that ends in {named}, got {output.path.name}", "change the ending"


def _fault_of_folder(output: Output) -> Fault:
    folder = real_path(output.path).parent
    while output.makes_folders and not folder.exists() and folder != folder.parent:
        folder = folder.parent
    if not folder.exists():
        return f"cannot be written: there is no folder {folder}", "create the folder first"
    if not folder.is_dir():
        return f"cannot be written: {folder} is not a folder", "give the name of a file in a folder"
    if not os.access(folder, os.W_OK | os.X_OK):
        return (
            f"cannot be written: you have no permission to write in the folder {folder}"
        ), "choose another folder"
    return None


def _is_recording(path: Path) -> bool:
    """By its ending, or by how it begins."""
    if path.suffix.lower() in RECORDING:
        return True
    with path.open("rb") as file:
        return file.read(len(MAGIC)) == MAGIC


@contextmanager
def disk_refusals(
    path: StrPath, kind: type[TomoskinError] = DataError, done: str = "written", hint: str = _SPACE
) -> Iterator[None]:
    """What the disk refuses in the block is an error of that ``kind`` that names ``path``."""
    try:
        yield
    except OSError as error:
        reason = f"cannot be {done}: {error.strerror or error}"
        raise kind(reason, where=str(path), hint=hint) from error


def read_refusals(
    path: StrPath, kind: type[TomoskinError] = DataError
) -> AbstractContextManager[None]:
    """What the disk refuses to read in the block is an error of that ``kind``."""
    return disk_refusals(str(path)[:80], kind, "read", hint="")


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
    with disk_refusals(path):
        try:
            os.close(os.open(part, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666))
            yield part
            _settle(part, target)
            check_outputs([Output(path)], overwrite=overwrite)  # the block may have taken hours
            part.replace(target)
        finally:
            part.unlink(missing_ok=True)


def write_text(path: StrPath, text: str, *, overwrite: bool = False) -> None:
    """Write ``text`` as UTF-8, complete or not at all; raises as :func:`written` does."""
    with written(path, overwrite=overwrite) as part:
        part.write_text(text, encoding="utf-8", newline="\n")


def write_rows(path: StrPath, rows: Iterable[Iterable[object]], *, overwrite: bool = False) -> None:
    """Write a CSV file, complete or not at all; raises as :func:`written` does."""
    with (
        written(path, overwrite=overwrite) as part,
        part.open("w", newline="", encoding="utf-8") as file,
    ):
        csv.writer(file, lineterminator="\n").writerows(rows)


def _settle(part: Path, target: Path) -> None:
    """On the disk, and readable by those who could read what was there."""
    with part.open("rb+") as file:
        os.fsync(file.fileno())
    if target.exists():
        part.chmod(stat.S_IMODE(target.stat().st_mode))


def check_is_file(
    path: StrPath, error: type[TomoskinError] = DataError, what: str = "a file"
) -> None:
    """Raise ``error`` where ``path`` is no ordinary file: a pipe or a device may never end."""
    path = Path(path)
    with read_refusals(path, error):
        if not path.exists():
            raise error("there is no such file", where=str(path))
        if path.is_dir():
            raise error(f"is a folder, not {what}", where=str(path))
        if not path.is_file():
            raise error(
                f"is a pipe or a device, not {what}",
                where=str(path),
                hint="copy what comes out of it into a file",
            )


def open_input(
    path: StrPath,
    buffering: int = -1,
    error: type[TomoskinError] = DataError,
    what: str = "a file",
) -> BinaryIO:
    """An ordinary file, open for reading bytes; ``what`` it should be is said in errors.

    Raises
    ------
    TomoskinError
        Of the kind ``error``, when it is missing, a folder, a pipe or a device, or unreadable.
    """
    check_is_file(path, error, what)
    with read_refusals(path, error):
        return Path(path).open("rb", buffering=buffering)


_SHARE = 4
"""A file may take one part in so many: what is made of it takes two or three times as much."""

_UNKNOWN = 4 << 30
"""Bytes of memory where the system does not say."""

_OF_CONTAINER = ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes")


def machine_memory() -> int:
    """Bytes of memory that this process can have: the machine's, its container's or its limit."""
    sizes = []
    with suppress(AttributeError, ValueError, OSError):
        sizes.append(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    for path in _OF_CONTAINER:
        with suppress(OSError, ValueError):  # "max" where there is no limit
            sizes.append(int(Path(path).read_text()))
    with suppress(ImportError):  # on Windows
        limits = import_module("resource")
        sizes.append(limits.getrlimit(limits.RLIMIT_AS)[0])
    return min((size for size in sizes if size > 0), default=_UNKNOWN)


def most_bytes() -> int:
    """Bytes that one file may take in memory."""
    return machine_memory() // _SHARE


def check_fits(size: int, where: str) -> None:
    """Raise DataError where ``size`` bytes are more than a file may take."""
    if size > most_bytes():
        raise DataError(
            f"takes {size / 2**30:.1f} GiB, more than a quarter of this machine's "
            f"{machine_memory() / 2**30:.1f} GiB of memory",
            where=where,
            hint="take a part of it, or a larger machine",
        )
