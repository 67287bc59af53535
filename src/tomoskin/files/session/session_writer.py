"""Writing a session: everything of a run in one MCAP file, in the order that it happened; a killed
program loses a second."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from copy import copy
from dataclasses import asdict, dataclass, field
from pathlib import Path
from threading import Lock
from typing import Any, Self

from mcap.records import Channel

from tomoskin import __version__
from tomoskin.board.wire import Info
from tomoskin.core import (
    DataError,
    Event,
    Frame,
    Image,
    Mark,
    Output,
    OutputError,
    PixelMap,
    StrPath,
    Touch,
    check_outputs,
    encode_json,
    plain_values,
)
from tomoskin.files.messages import (
    Contact,
    deformation_content,
    grid_message,
    log_message,
    scene_message,
    touch_row,
)
from tomoskin.files.session import channels
from tomoskin.files.session.channels import CHANNELS, SCHEMAS, SPAN, robot_channels
from tomoskin.files.session.container import ContainerWriter
from tomoskin.files.session.layout import encode_frame, encode_raw
from tomoskin.model.mesh import Plane
from tomoskin.model.skin import Skin
from tomoskin.sensing.fit import Deformation

FORMAT = 1
"""Version of the channels and their layout."""

ABOUT = "tomoskin"
"""Name of the strings that say what the file is."""

SKINS = "skins"
"""Key of the strings by which a file of several skins names them, in their order."""

SKIN_FILE = "skin.toml"
"""Name of the attachment that holds the skin."""

_FLAT = Plane()

OLD_INDEX_FILE = "tomoskin.seek"
"""Name of an attachment in files of 0.1: offsets in the file, which a copy must not keep."""


def about_session(skin: Skin, epoch: float) -> dict[str, str]:
    """What a session of ``skin`` says of itself; ``epoch`` + host time = seconds since 1970."""
    return {
        "format": str(FORMAT),
        "epoch_s": repr(float(epoch)),
        "skin": skin.name,
        "skin_identity": skin.identity,
        "electrodes": str(skin.n_electrodes),
    }


def robot_logs(
    path: StrPath, names: Sequence[str], *, epoch: float, start: float
) -> dict[str, MessageLog]:
    """One new file for the sessions of a robot's skins: a log for each, by its name.

    The file ends when the last has. Raises OutputError when it exists or cannot be made.
    """
    channels = robot_channels(names)
    whole = MessageLog(path, epoch=epoch, start=start, channels=channels)
    about = {"format": str(FORMAT), "epoch_s": repr(float(epoch)), SKINS: " ".join(names)}
    whole.describe(ABOUT, about)
    return whole.parts(names)


class SessionWriter(AbstractContextManager["SessionWriter"]):
    """Writes one session file; a context manager.

    The same calls give the same bytes: no time of day goes in but the one given. Messages are
    logged at their host time (monotonic s) plus ``epoch``.

    Parameters
    ----------
    path
        A file that does not exist yet.
    skin
        The skin whose frames these are; its file goes in.
    epoch
        What is added to a host time to give seconds since 1970; 0: the log times are host times.
    start
        Host time that what has no time of its own is logged at.
    log
        Where the session goes, instead of a file of its own; ``epoch`` is then the log's.

    Raises
    ------
    OutputError
        When the file exists or cannot be made.
    DataError
        From every method: see :class:`MessageLog`.
    """

    def __init__(
        self,
        path: StrPath,
        skin: Skin,
        *,
        epoch: float = 0.0,
        start: float = 0.0,
        log: MessageLog | None = None,
    ) -> None:
        self.path = Path(path)
        self._start = start
        self._log = MessageLog(self.path, epoch=epoch, start=start) if log is None else log
        self._log.describe(ABOUT, about_session(skin, self._log.epoch))
        self.attach(SKIN_FILE, "application/toml", skin.to_toml().encode())

    def attach(self, name: str, media_type: str, data: bytes) -> None:
        """Put a file inside: a calibration, a photograph."""
        self._log.attach(name, media_type, data)

    def settle(self) -> None:
        """Write the open chunk, and see that the file is still in its folder."""
        self._log.settle()

    def close(self) -> None:
        """End the session; a second call does nothing."""
        self._log.close()

    def __exit__(self, *_: object) -> None:
        """End the session at the end of the block."""
        self.close()

    def raw(self, host_time: float, data: bytes) -> None:
        """Bytes as they were read from the source at ``host_time``."""
        self._log.put(channels.RAW, host_time, encode_raw(host_time, data))

    def frame(self, frame: Frame, mark: Mark = Mark.NONE) -> None:
        """One frame, and what became of it; after the raw bytes that it came in.

        A frame from before ``start`` is logged at ``start``.
        """
        self._log.put(channels.FRAMES, max(frame.host_time, self._start), encode_frame(frame, mark))

    def touches(
        self,
        host_time: float,
        sequence: int,
        touches: Sequence[Touch],
        deformation: Deformation | None = None,
    ) -> None:
        """Touches of the frame ``sequence``, and how the sheet is deformed in it; none is worth
        saying when there were some before."""
        rows = [touch_row(touch) for touch in touches]
        content: dict[str, Any] = {"host_time": host_time, "sequence": sequence, "touches": rows}
        if deformation is not None:
            content["deformation"] = deformation_content(deformation)
        _put(self._log, channels.TOUCHES, host_time, content)

    def image(
        self, host_time: float, image: Image, pixels: PixelMap, touches: Sequence[Touch] = ()
    ) -> None:
        """One image for tools that show it, with its touches; the frames give it exactly."""
        log_time = self._log.log_time(host_time)
        shown = Contact.each(touches, _FLAT)
        _put(self._log, channels.IMAGE, host_time, grid_message(image, pixels, host_time, log_time))
        _put(self._log, channels.SCENE, host_time, scene_message(shown, log_time))

    def truth(self, host_time: float, presses: Sequence[Any], bends: Sequence[Any] = ()) -> None:
        """What presses on the twin, and how it is bent, from ``host_time`` on.

        Each press is a mapping or a record with ``x``, ``y``, ``force``, ``radius`` (SI) and
        whatever else describes it; each bend one with ``kind``, ``axis`` (rad) and ``angle``
        (rad) or ``strain``.
        """
        content = {"host_time": host_time, "presses": [plain_values(press) for press in presses]}
        if bends:
            content["bends"] = [plain_values(bend) for bend in bends]
        _put(self._log, channels.TRUTH, host_time, content)

    def event(self, event: Event) -> None:
        """Write an event of the run; a person's remark is one of the kind "note"."""
        content = log_message(event, self._log.log_time(event.host_time))
        channel = channels.NOTES if event.kind == "note" else channels.EVENTS
        _put(self._log, channel, event.host_time, content)

    def note(self, host_time: float, text: str) -> None:
        """A person's remark at ``host_time``."""
        self.event(Event(host_time, "note", text))

    def device(self, host_time: float, info: Info, name: str = "") -> None:
        """What the board says that it is, and what it calls itself, if anything."""
        content = {"host_time": host_time} | asdict(info)
        content |= {
            "firmware": ".".join(map(str, info.firmware)),
            "unique_id": info.unique_id.hex(),
            "reset": info.reset.name,
        }
        if name:
            content["name"] = name
        del content["request"]
        _put(self._log, channels.DEVICE, host_time, content)

    def clock(self, host_time: float, fit: Any) -> None:
        """A fit of the device's clock to the host's: a mapping or record, see the schema."""
        _put(self._log, channels.CLOCK, host_time, {"host_time": host_time} | plain_values(fit))

    def settings(self, host_time: float, settings: Mapping[str, Any]) -> None:
        """How the run was set: plain values by name."""
        _put(self._log, channels.SETTINGS, host_time, {"host_time": host_time} | dict(settings))


def _put(log: MessageLog, channel: int, host_time: float, content: Mapping[str, Any]) -> None:
    log.put(channel, host_time, encode_json(content))


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
