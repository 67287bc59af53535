"""What a page may ask for, decoded strictly: unknown fields and impossible numbers are errors."""

from __future__ import annotations

from typing import Annotated, Any

import msgspec
from msgspec import Meta

from tomoskin.core import WireError
from tomoskin.run import TwinRequest
from tomoskin.server.flow_requests import FlowRequest

MAX_REQUEST = 32_768
"""Longest request, bytes: a pattern of some thousand rows, written out."""

MAX_NOTE = 500
"""Longest note, characters."""

_Name = Annotated[str, Meta(pattern=r"^[A-Za-z0-9][A-Za-z0-9_-]{0,63}\Z")]
"""Of a file: no folder, no ending, nothing hidden."""


class TakeReference(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag="reference"):
    """The next frames become the reference."""


Value = str | int | float | list[Any] | None
"""A value as a skin file writes it; null takes the key out."""


class SetSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag="settings"):
    """Other values of the skin's keys, by section; the skin's schema says what each may be."""

    changes: dict[str, dict[str, Value]]


class UndoSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag="undo"):
    """Take the last change of settings back."""


class RedoSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag="redo"):
    """Make it again."""


class SaveSkin(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag="save_skin"):
    """Write the settings to a skin file of the server's folder."""

    name: _Name
    replace: bool = False


class LoadSkin(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag="load_skin"):
    """Take the settings of a skin file of the server's folder, or of a built-in skin."""

    name: _Name


class AskPattern(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag="pattern"):
    """The rows of a named pattern on the skin's electrodes, to be edited."""

    name: Annotated[str, Meta(max_length=64)]


class SetPause(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag="pause"):
    """Hold the picture, or let it go on."""

    on: bool


class SetRecording(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag="record"):
    """Record to a new file in the server's folder, or end the recording."""

    on: bool


class Note(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag="note"):
    """A remark on the picture of this moment."""

    text: Annotated[str, Meta(min_length=1, max_length=MAX_NOTE)]


class Painted(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag="painted"):
    """How long the page took of late from a frame's arrival to the end of drawing it, s."""

    p50_s: Annotated[float, Meta(ge=0, le=3600)]
    p99_s: Annotated[float, Meta(ge=0, le=3600)]


class Seek(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag="seek"):
    """Play the recording from so many seconds after its first frame on."""

    at_s: Annotated[float, Meta(ge=0, le=1e9)]


class Step(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag="step"):
    """Play one read of the recording and stand still."""


class SetSpeed(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag="speed"):
    """Recorded seconds per second; null for as fast as the pictures are made."""

    speed: Annotated[float, Meta(gt=0, le=1000)] | None


class SetLoop(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag="loop"):
    """Begin the recording again at its end, or not."""

    on: bool


ReplayRequest = Seek | Step | SetSpeed | SetLoop
"""What only a replay can do."""

SettingsRequest = SetSettings | UndoSettings | RedoSettings | SaveSkin | LoadSkin | AskPattern

Request = (
    TakeReference
    | SetPause
    | SetRecording
    | Note
    | Painted
    | TwinRequest
    | SettingsRequest
    | ReplayRequest
    | FlowRequest
)

_DECODER: msgspec.json.Decoder[Request] = msgspec.json.Decoder(Request)


def decode_request(data: str | bytes) -> Request:
    """One request from a page's message.

    Raises
    ------
    WireError
        When it is too long, not JSON, of unknown type or with an impossible value.
    """
    if len(data) > MAX_REQUEST:
        raise WireError(f"expected a message of at most {MAX_REQUEST} bytes, got {len(data)}")
    try:
        return _DECODER.decode(data)
    except (msgspec.DecodeError, UnicodeError) as error:
        raise WireError(f"a message that is not understood: {error}") from None
