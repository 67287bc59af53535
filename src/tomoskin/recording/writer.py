"""Writing a session: everything of a run in one MCAP file, in the order that it happened."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

from tomoskin import __version__
from tomoskin.core import (
    DataError,
    Event,
    Frame,
    Image,
    Output,
    OutputError,
    PixelMap,
    Touch,
    check_outputs,
)
from tomoskin.recording import channels
from tomoskin.recording.container import ContainerWriter
from tomoskin.recording.documents import encode_json, plain, touches_message
from tomoskin.recording.foxglove import grid_message, log_message, scene_message
from tomoskin.recording.layout import Mark, encode_frame, encode_raw

if TYPE_CHECKING:
    from tomoskin.skin import Skin
    from tomoskin.wire import Info

FORMAT = 1
"""Version of the channels and their layout."""

ABOUT = "tomoskin"
"""Name of the strings that say what the file is."""

SKIN_FILE = "skin.toml"
"""Name of the attachment that holds the skin."""

LIBRARY = f"tomoskin {__version__}"
PATIENCE = 1_000_000_000
"""An open chunk is written once it spans so many ns, however short it is."""


class SessionWriter:
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

    Raises
    ------
    OutputError
        When the file exists or cannot be made.
    DataError
        From every method: when the file cannot be written any further (disk full, drive gone).
        What was written before stays readable; nothing more is written.
    """

    def __init__(self, path: Path, skin: Skin, *, epoch: float = 0.0, start: float = 0.0) -> None:
        self.path = path
        self.epoch = epoch
        self._now = self._start = start
        self._flushed = 0
        check_outputs([Output(path)])
        with said_of(self.path):
            file = path.open("xb", buffering=0)
            self._file = ContainerWriter(file, LIBRARY, channels.SCHEMAS, channels.CHANNELS)
            self._file.describe(ABOUT, _about(skin, epoch))
            self._file.attach(SKIN_FILE, "application/toml", skin.to_toml().encode())

    @property
    def size(self) -> int:
        """Bytes in the file so far."""
        return self._file.size

    def raw(self, host_time: float, data: bytes) -> None:
        """Bytes as they were read from the source at ``host_time``."""
        self._put(channels.RAW, host_time, encode_raw(host_time, data))

    def frame(self, frame: Frame, mark: Mark = Mark.NONE) -> None:
        """One frame, and what became of it; after the raw bytes that it came in.

        A frame from before ``start`` is logged at ``start``.
        """
        self._put(channels.FRAMES, max(frame.host_time, self._start), encode_frame(frame, mark))

    def touches(self, host_time: float, sequence: int, touches: Sequence[Touch]) -> None:
        """Touches of the frame ``sequence``; none is worth saying when there were some before."""
        self._say(channels.TOUCHES, host_time, touches_message(host_time, sequence, touches))

    def image(
        self, host_time: float, image: Image, pixels: PixelMap, touches: Sequence[Touch] = ()
    ) -> None:
        """One image for tools that show it, with its touches; the frames give it exactly."""
        log_time = self._log_time(host_time)
        self._say(channels.IMAGE, host_time, grid_message(image, pixels, host_time, log_time))
        self._say(channels.SCENE, host_time, scene_message(touches, log_time))

    def truth(self, host_time: float, presses: Sequence[Any], bends: Sequence[Any] = ()) -> None:
        """What presses on the twin, and how it is bent, from ``host_time`` on.

        Each press is a mapping or a record with ``x``, ``y``, ``force``, ``radius`` (SI) and
        whatever else describes it; each bend one with ``kind``, ``axis`` (rad) and ``angle``
        (rad) or ``strain``.
        """
        content = {"host_time": host_time, "presses": [plain(press) for press in presses]}
        if bends:
            content["bends"] = [plain(bend) for bend in bends]
        self._say(channels.TRUTH, host_time, content)

    def event(self, event: Event) -> None:
        """Something that happened."""
        log_time = self._log_time(event.host_time)
        self._say(channels.EVENTS, event.host_time, log_message(event, log_time))

    def note(self, host_time: float, text: str) -> None:
        """A person's remark at ``host_time``."""
        event = Event(host_time, "note", text)
        self._say(channels.NOTES, host_time, log_message(event, self._log_time(host_time)))

    def device(self, host_time: float, info: Info) -> None:
        """What the board says that it is."""
        content = {"host_time": host_time} | dataclasses.asdict(info)
        content |= {
            "firmware": ".".join(map(str, info.firmware)),
            "unique_id": info.unique_id.hex(),
            "reset": info.reset.name,
        }
        del content["request"]
        self._say(channels.DEVICE, host_time, content)

    def settle(self) -> None:
        """Write the open chunk, and see that the file is still in its folder."""
        with said_of(self.path):
            self._file.flush()
        if not self._file.is_linked:
            raise DataError("has been removed while it was written", where=str(self.path))

    def clock(self, host_time: float, fit: Any) -> None:
        """A fit of the device's clock to the host's: a mapping or record, see the schema."""
        self._say(channels.CLOCK, host_time, {"host_time": host_time} | plain(fit))

    def settings(self, host_time: float, settings: Mapping[str, Any]) -> None:
        """How the run was set: plain values by name."""
        self._say(channels.SETTINGS, host_time, {"host_time": host_time} | dict(settings))

    def attach(self, name: str, media_type: str, data: bytes) -> None:
        """Put a file inside: a calibration, a photograph."""
        with said_of(self.path):
            self._file.attach(name, media_type, data, self._log_time(self._now))

    def close(self) -> None:
        """End the file with its index; a second call does nothing."""
        with said_of(self.path):
            self._file.close()

    def __enter__(self) -> Self:
        """The writer itself."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Close."""
        self.close()

    def _say(self, channel: int, host_time: float, content: Mapping[str, Any]) -> None:
        self._put(channel, host_time, encode_json(content))

    def _put(self, channel: int, host_time: float, data: bytes) -> None:
        log_time = self._log_time(host_time)
        self._now = host_time
        with said_of(self.path):
            self._file.message(channel, log_time, data)
            if log_time - self._flushed >= PATIENCE:
                self._file.flush()
                self._flushed = log_time

    def _log_time(self, host_time: float) -> int:
        """Ns of a message; DataError for a time that is none or before the epoch."""
        seconds = host_time + self.epoch
        if not 0 <= seconds < 2**33:
            raise DataError(
                f"expected a host time of 0 s or more after the epoch, got {host_time} s",
                where=str(self.path),
            )
        return round(seconds * 1e9)


@contextmanager
def said_of(path: Path) -> Iterator[None]:
    """OSError → DataError that names the file."""
    try:
        yield
    except FileExistsError:  # made since it was looked for
        raise OutputError("exists already", where=str(path), hint="choose another name") from None
    except OSError as error:
        raise DataError(
            f"cannot be read or written: {error.strerror or error}",
            where=str(path),
            hint=_ADVICE.get(type(error), "look at the disk"),
        ) from error


_ADVICE: dict[type[OSError], str] = {
    FileNotFoundError: "make the folder first",
    IsADirectoryError: "name a file",
    NotADirectoryError: "name a file in a folder",
    PermissionError: "choose another place",
}


def _about(skin: Skin, epoch: float) -> dict[str, str]:
    return {
        "format": str(FORMAT),
        "epoch_s": repr(float(epoch)),
        "skin": skin.name,
        "skin_identity": skin.identity,
        "electrodes": str(skin.n_electrodes),
    }
