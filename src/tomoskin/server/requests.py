"""What a page may ask for, decoded strictly: unknown fields and impossible numbers are errors.

Requests that are commands to the run stand in ``run/commands.py``.
"""

from __future__ import annotations

from functools import reduce
from operator import or_
from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from tomoskin.core import WireError
from tomoskin.run import StrictRequest

MAX_REQUEST = 32_768
"""Longest request, bytes: a pattern of some thousand rows, written out."""

NAME = r"[A-Za-z0-9][A-Za-z0-9._-]{0,119}"
"""Of a file that a page may ask for: no folder, nothing hidden."""

STEM = r"[A-Za-z0-9][A-Za-z0-9_-]{0,63}"
"""The same without its ending."""

MOST_NOTES = 4000
"""Letters of the notes on a session."""

FileName = Annotated[str, Meta(pattern=rf"^{NAME}\Z")]
"""Of a file in the session folder: no folder, nothing hidden; ``server/folder.py`` looks again."""

Stem = Annotated[str, Meta(pattern=rf"^{STEM}\Z")]
"""Of a file, without its ending: no folder, nothing hidden."""

Format = Literal["touches", "csv", "npz", "mat", "h5", "parquet", "png", "gif"]

Unit = Literal["N", "g", "kg", "mm"]

Calibrated = Literal["touch", "force", "depth"]
"""What a calibration that a page can choose is of."""

Plain = str | int | float
Value = Plain | list[Plain | list[Plain | list[Plain]]] | None
"""A value as a skin file writes it; null takes the key out."""


# The run.


class SetRecording(StrictRequest, frozen=True, tag="record"):
    """Record to a new file in the server's folder, or end the recording."""

    on: bool


class AskUnresolved(StrictRequest, frozen=True, tag="unresolved"):
    """The map of what the data cannot tell, with the electrodes and the alpha of the moment."""


class ShowDent(StrictRequest, frozen=True, tag="dent"):
    """This page shows the dent of touches, or does not any more; it is answered what there is."""

    on: bool


class Painted(StrictRequest, frozen=True, tag="painted"):
    """How long the page took of late from a frame's arrival to the end of drawing it, s."""

    p50_s: Annotated[float, Meta(ge=0, le=3600)]
    p99_s: Annotated[float, Meta(ge=0, le=3600)]


# The skin's settings.


class SetSettings(StrictRequest, frozen=True, tag="settings"):
    """Other values of the skin's keys, by section; the skin's schema says what each may be."""

    changes: dict[str, dict[str, Value]]


class UndoSettings(StrictRequest, frozen=True, tag="undo"):
    """Take the last change of settings back."""


class RedoSettings(StrictRequest, frozen=True, tag="redo"):
    """Repeat the change that was undone."""


class SaveSkin(StrictRequest, frozen=True, tag="save_skin"):
    """Write the settings to a skin file of the server's folder."""

    name: Stem
    replace: bool = False


class LoadSkin(StrictRequest, frozen=True, tag="load_skin"):
    """Take the settings of a skin file of the server's folder, or of a built-in skin."""

    name: Stem


class AskPattern(StrictRequest, frozen=True, tag="pattern"):
    """The rows of a named pattern on the skin's electrodes, to be edited."""

    name: Annotated[str, Meta(max_length=64)]


# Files, sources, and presses where the dot is.


class ListFiles(StrictRequest, frozen=True, tag="files"):
    """What is in the session folder."""


class OpenSession(StrictRequest, frozen=True, tag="open"):
    """Play a session of the folder."""

    name: FileName


class GoLive(StrictRequest, frozen=True, tag="live"):
    """Back from a replay to the source before it."""


class ExportSession(StrictRequest, frozen=True, tag="export"):
    """Convert a session of the folder to another format, into the folder."""

    name: FileName
    format: Format


class RenameSession(StrictRequest, frozen=True, tag="rename"):
    """Give a session of the folder another name."""

    name: FileName
    to: Stem


class DeleteSession(StrictRequest, frozen=True, tag="delete"):
    """Delete a session of the folder."""

    name: FileName


class Annotate(StrictRequest, frozen=True, tag="annotate"):
    """Write notes on a session of the folder, in place of older ones."""

    name: FileName
    text: Annotated[str, Meta(max_length=MOST_NOTES)]


class ListSources(StrictRequest, frozen=True, tag="sources"):
    """The page asks what can be connected."""


class Connect(StrictRequest, frozen=True, tag="connect"):
    """Connect one of the sources that were listed."""

    source: Annotated[str, Meta(max_length=200)]


class BeginFlow(StrictRequest, frozen=True, tag="flow_begin"):
    """Ask for presses: where the dot is, to learn touch or to find the channel mapping; with known
    weights or to known depths, to learn these; or as another flow of those that are offered."""

    kind: Annotated[str, Meta(max_length=64)]


class ShowFlow(StrictRequest, frozen=True, tag="flow_show"):
    """This page shows the flow, or hides it: while no page shows it, it is paused."""

    on: bool


class DeletePress(StrictRequest, frozen=True, tag="flow_delete"):
    """Take one press back, by its number from 0 on; null: the last one."""

    number: Annotated[int, Meta(ge=0, le=10_000)] | None = None


class SetLabel(StrictRequest, frozen=True, tag="flow_label"):
    """The weight or depth of a press, or the next; ``sure``: an unusual one is meant as it is said.

    What a person types is judged by the flow, which says what is wrong with it.
    """

    value: float
    unit: Unit
    sure: bool = False


class AskPoint(StrictRequest, frozen=True, tag="flow_point"):
    """Ask for a press at a known position beside the rubbing, or go on without."""

    on: bool


class LearnFlow(StrictRequest, frozen=True, tag="flow_learn"):
    """Learn from what was rubbed so far."""


class StopLearning(StrictRequest, frozen=True, tag="flow_stop"):
    """The page ends what is being learnt."""


class EndFlow(StrictRequest, frozen=True, tag="flow_end"):
    """Leave the flow; what was pressed is forgotten."""


class KeepFlow(StrictRequest, frozen=True, tag="flow_keep"):
    """Write what the presses tell to a file of the folder, and use it from now on."""

    name: Stem


class UseCalibration(StrictRequest, frozen=True, tag="calibration"):
    """Use a calibration of the folder; null: none of those ``of`` touch, force or depth."""

    name: FileName | None
    of: Calibrated = "touch"


REQUESTS = tuple(kind for kind in StrictRequest.__subclasses__() if kind.__struct_config__.tag)
"""All that a page may ask: every request of these modules that has a type of its own."""

REQUEST = reduce(or_, REQUESTS)
"""Any of them, as a type."""

_DECODER: msgspec.json.Decoder[StrictRequest] = msgspec.json.Decoder(REQUEST)


def decode_request(data: str | bytes) -> StrictRequest:
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
    except (msgspec.DecodeError, UnicodeError, RecursionError) as error:
        raise WireError(
            f"the message of the page is not understood (reload the page): {error}"
        ) from None
