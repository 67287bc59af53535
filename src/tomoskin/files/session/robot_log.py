"""One file for the sessions of all skins of a robot."""

from __future__ import annotations

import threading
from collections.abc import Mapping, Sequence
from pathlib import Path

from tomoskin.core import StrPath
from tomoskin.files.session.channels import SPAN, robot_channels
from tomoskin.files.session.message_log import MessageLog
from tomoskin.files.session.session_writer import ABOUT, FORMAT, SKINS


class RobotLog:
    """Takes the messages of several sessions into one file; each writes to a part of its own.

    The file ends when the last part has. Parts may be written from different threads.

    Parameters
    ----------
    path
        A file that does not exist yet.
    names
        Of the skins.
    epoch, start
        As of a :class:`~tomoskin.files.session.SessionWriter`.

    Attributes
    ----------
    log, lock
        The file, and what is held while it is written.
    parts
        By the names of the skins.

    Raises
    ------
    OutputError
        When the file exists or cannot be made.
    """

    def __init__(self, path: StrPath, names: Sequence[str], *, epoch: float, start: float) -> None:
        path = Path(path)
        self.log = MessageLog(path, epoch=epoch, start=start, channels=robot_channels(names))
        self.lock, self._open = threading.Lock(), len(names)
        self.parts: Mapping[str, LogPart] = {
            name: LogPart(self, name, SPAN * number) for number, name in enumerate(names)
        }
        about = {"format": str(FORMAT), "epoch_s": repr(float(epoch)), SKINS: " ".join(names)}
        self.log.describe(ABOUT, about)

    @property
    def path(self) -> Path:
        """The path of the file."""
        return self.log.path

    @property
    def epoch(self) -> float:
        """What is added to a host time to give seconds since 1970."""
        return self.log.epoch

    def leave(self) -> None:
        """Note that one part is complete."""
        with self.lock:
            self._open -= 1
            if not self._open:
                self.log.close()


class LogPart:
    """The messages of one skin in the file of all; raises as a session's own file does."""

    def __init__(self, whole: RobotLog, name: str, first: int) -> None:
        self.path, self.epoch = whole.path, whole.epoch
        self._whole, self._name, self._first = whole, name, first
        self._left = False

    def describe(self, name: str, about: Mapping[str, str]) -> None:
        """Put named strings inside, under the skin's name."""
        with self._whole.lock:
            self._whole.log.describe(f"{self._name}/{name}", about)

    def attach(self, name: str, media_type: str, data: bytes) -> None:
        """Put a file inside, under the skin's name."""
        with self._whole.lock:
            self._whole.log.attach(f"{self._name}/{name}", media_type, data)

    def put(self, channel: int, host_time: float, data: bytes) -> None:
        """Add a message to one of the skin's channels."""
        with self._whole.lock:
            self._whole.log.put(self._first + channel, host_time, data)

    def log_time(self, host_time: float) -> int:
        """Time of a message, ns."""
        return self._whole.log.log_time(host_time)

    def settle(self) -> None:
        """Write the open chunk, and see that the file is still in its folder."""
        with self._whole.lock:
            self._whole.log.settle()

    def close(self) -> None:
        """No more comes of this skin; a second call does nothing."""
        if not self._left:
            self._left = True
            self._whole.leave()
