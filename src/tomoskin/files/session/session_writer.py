"""Writing a session: everything of a run in one MCAP file, in the order that it happened."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

from tomoskin.board.wire import Info
from tomoskin.core import (
    Event,
    Frame,
    Image,
    Mark,
    PixelMap,
    StrPath,
    Touch,
    encode_json,
    plain_values,
)
from tomoskin.files.messages import Contact, grid_message, log_message, scene_message, touch_row
from tomoskin.files.session import channels
from tomoskin.files.session.channels import robot_channels
from tomoskin.files.session.layout import encode_frame, encode_raw
from tomoskin.files.session.message_log import MessageLog
from tomoskin.model.mesh import Plane
from tomoskin.model.skin import Skin

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
        self.path = path if isinstance(path, Path) else Path(path)
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

    def touches(self, host_time: float, sequence: int, touches: Sequence[Touch]) -> None:
        """Touches of the frame ``sequence``; none is worth saying when there were some before."""
        rows = [touch_row(touch) for touch in touches]
        content = {"host_time": host_time, "sequence": sequence, "touches": rows}
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
        content = {"host_time": host_time} | dataclasses.asdict(info)
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
