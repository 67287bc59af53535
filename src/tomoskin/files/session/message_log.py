"""Messages in the order that they happen, in one MCAP file; a killed program loses a second."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

from mcap.records import Channel

from tomoskin import __version__
from tomoskin.core import DataError, Output, OutputError, StrPath, check_outputs
from tomoskin.files.session.channels import CHANNELS, SCHEMAS
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
        path: Path,
        *,
        epoch: float,
        start: float,
        channels: Sequence[Channel] = CHANNELS,
    ) -> None:
        self.path, self.epoch = path, epoch
        self._now = start
        self._flushed = 0
        check_outputs([Output(path)])
        with errors_of(path):
            file = path.open("xb", buffering=0)
            self._file = ContainerWriter(file, LIBRARY, SCHEMAS, channels)

    def describe(self, name: str, about: Mapping[str, str]) -> None:
        """Put named strings inside: what the file says of itself."""
        with errors_of(self.path):
            self._file.describe(name, about)

    def put(self, channel: int, host_time: float, data: bytes) -> None:
        """Add a message that is logged at ``host_time``."""
        log_time = self.log_time(host_time)
        self._now = host_time
        with errors_of(self.path):
            self._file.message(channel, log_time, data)
            if log_time - self._flushed >= _SECOND:
                self._file.flush()
                self._flushed = log_time

    def attach(self, name: str, media_type: str, data: bytes) -> None:
        """Put a file inside: a calibration, a photograph."""
        with errors_of(self.path):
            self._file.attach(name, media_type, data, self.log_time(self._now))

    def settle(self) -> None:
        """Write the open chunk, and see that the file is still in its folder."""
        with errors_of(self.path):
            self._file.flush()
        self._flushed = self.log_time(self._now)
        if not self._file.is_linked:
            raise DataError("was removed during the recording", where=str(self.path))

    def close(self) -> None:
        """End the file with its index; a second call does nothing."""
        with errors_of(self.path):
            self._file.close()

    def log_time(self, host_time: float) -> int:
        """Ns of a message; DataError for a time that is none or before the epoch."""
        seconds = host_time + self.epoch
        if not 0 <= seconds < 2**33:
            raise DataError(
                f"expected a host time of 0 s or more after the epoch, got {host_time} s",
                where=str(self.path),
            )
        return round(seconds * 1e9)


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
