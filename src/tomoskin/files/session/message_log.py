"""Messages in the order that they happen, in one MCAP file; a killed program loses a second."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from copy import copy
from dataclasses import dataclass, field
from pathlib import Path
from threading import Lock
from typing import Self

from mcap.records import Channel

from tomoskin import __version__
from tomoskin.core import DataError, Output, OutputError, StrPath, check_outputs
from tomoskin.files.session.channels import CHANNELS, SCHEMAS, SPAN
from tomoskin.files.session.container import ContainerWriter

LIBRARY = f"tomoskin {__version__}"
"""What a file says that it was written by."""

_SECOND = 1_000_000_000
"""An open chunk is written once it spans so many ns, however short it is."""

_ADVICE: dict[type[OSError], str] = {
    FileNotFoundError: "create the folder first",
    IsADirectoryError: "name a file",
    NotADirectoryError: "give the name of a file in a folder",
    PermissionError: "choose another folder",
}


class MessageLog:
    """Writes messages of :data:`~tomoskin.files.session.channels.CHANNELS`; a context manager.

    Parameters
    ----------
    path
        A file that does not exist yet.
    epoch
        What is added to a host time (monotonic s) to give seconds since 1970; 0: the log times
        are host times.
    start
        Host time of what has none of its own.
    channels
        All that it will hold.

    Raises
    ------
    OutputError
        When the file exists or cannot be made.
    DataError
        From every method: when the file cannot be written any further (disk full, drive gone).
        What was written before stays readable; nothing more is written.
    """

    def __init__(
        self,
        path: StrPath,
        *,
        epoch: float,
        start: float,
        channels: Sequence[Channel] = CHANNELS,
    ) -> None:
        path = Path(path)
        self.path, self.epoch = path, epoch
        self._now, self._prefix, self._first, self._is_open = start, "", 0, True
        check_outputs([Output(path)])
        with errors_of(path):
            file = path.open("xb", buffering=0)
            self._file = _File(ContainerWriter(file, LIBRARY, SCHEMAS, channels))

    def parts(self, names: Sequence[str]) -> dict[str, Self]:
        """A log for each of several sessions in this file, by name; the last to close ends it.

        They may be written from different threads.
        """
        parts = {}
        self._file.users = len(names)
        for number, name in enumerate(names):
            parts[name] = part = copy(self)
            part._prefix, part._first = f"{name}/", SPAN * number
        return parts

    def describe(self, name: str, about: Mapping[str, str]) -> None:
        """Put named strings inside: what the file says of itself."""
        file = self._file
        with file.lock, errors_of(self.path):
            file.container.describe(self._prefix + name, about)

    def put(self, channel: int, host_time: float, data: bytes) -> None:
        """Add a message that is logged at ``host_time``."""
        log_time = self.log_time(host_time)
        self._now = host_time
        file = self._file
        with file.lock, errors_of(self.path):
            file.container.message(self._first + channel, log_time, data)
            if log_time - file.flushed >= _SECOND:
                file.container.flush()
                file.flushed = log_time

    def attach(self, name: str, media_type: str, data: bytes) -> None:
        """Put a file inside: a calibration, a photograph."""
        log_time = self.log_time(self._now)
        file = self._file
        with file.lock, errors_of(self.path):
            file.container.attach(self._prefix + name, media_type, data, log_time)

    def settle(self) -> None:
        """Write the open chunk, and see that the file is still in its folder."""
        file = self._file
        with file.lock, errors_of(self.path):
            file.container.flush()
            file.flushed = self.log_time(self._now)
        if not file.container.is_linked:
            raise DataError("was removed during the recording", where=str(self.path))

    def close(self) -> None:
        """End the file with its index; a second call does nothing."""
        file = self._file
        with file.lock, errors_of(self.path):
            file.users -= self._is_open
            self._is_open = False
            if not file.users:
                file.container.close()

    def log_time(self, host_time: float) -> int:
        """Ns of a message; DataError for a time that is none or before the epoch."""
        seconds = host_time + self.epoch
        if not 0 <= seconds < 2**33:
            raise DataError(
                f"expected a host time of 0 s or more after the epoch, got {host_time} s",
                where=str(self.path),
            )
        return round(seconds * 1e9)


@dataclass
class _File:
    """A file that several logs may write: when it was last flushed, and how many are open."""

    container: ContainerWriter
    flushed: int = 0
    users: int = 1
    lock: Lock = field(default_factory=Lock)


@contextmanager
def errors_of(path: StrPath) -> Iterator[None]:
    """OSError → DataError that names the file."""
    try:
        yield
    except FileExistsError:  # made since it was looked for
        raise OutputError("exists already", where=str(path), hint="choose another name") from None
    except OSError as error:
        raise DataError(
            f"cannot be read or written: {error.strerror or error}",
            where=str(path),
            hint=_ADVICE.get(type(error), "check that the disk is connected and has space"),
        ) from error
