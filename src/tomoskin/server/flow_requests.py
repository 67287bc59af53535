"""What a page may ask of the flows: files, sources, and presses where the dot is."""

from __future__ import annotations

from typing import Annotated, Literal

import msgspec
from msgspec import Meta

FileName = Annotated[str, Meta(pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]{0,119}\Z")]
"""Of a file in the session folder: no folder, nothing hidden; ``server/folder.py`` looks again."""

Stem = Annotated[str, Meta(pattern=r"^[A-Za-z0-9][A-Za-z0-9_-]{0,63}\Z")]
"""Of a file that is to be written, without its ending."""

Format = Literal["touches", "csv", "npz", "mat", "h5", "parquet", "png", "gif"]

FlowKind = Literal["touch", "wiring"]


class _Request(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    pass


class ListFiles(_Request, frozen=True, tag="files"):
    """What is in the session folder."""


class OpenSession(_Request, frozen=True, tag="open"):
    """Play a session of the folder."""

    name: FileName


class GoLive(_Request, frozen=True, tag="live"):
    """Back from a replay to the source before it."""


class ExportSession(_Request, frozen=True, tag="export"):
    """Convert a session of the folder to another format, into the folder."""

    name: FileName
    format: Format


class ListSources(_Request, frozen=True, tag="sources"):
    """What can be connected."""


class Connect(_Request, frozen=True, tag="connect"):
    """Connect one of the sources that were listed."""

    source: Annotated[str, Meta(max_length=200)]


class BeginFlow(_Request, frozen=True, tag="flow_begin"):
    """Ask for presses where the dot is: to learn touch, or to find the wiring."""

    kind: FlowKind


class UndoPress(_Request, frozen=True, tag="flow_undo"):
    """Take the last press back."""


class EndFlow(_Request, frozen=True, tag="flow_end"):
    """Leave the flow; what was pressed is forgotten."""


class KeepFlow(_Request, frozen=True, tag="flow_keep"):
    """Write what the presses tell to a file of the folder, and use it from now on."""

    name: Stem


class UseCalibration(_Request, frozen=True, tag="calibration"):
    """Places of touches by a calibration of the folder; null: by the picture again."""

    name: FileName | None


FlowRequest = (
    ListFiles
    | OpenSession
    | GoLive
    | ExportSession
    | ListSources
    | Connect
    | BeginFlow
    | UndoPress
    | EndFlow
    | KeepFlow
    | UseCalibration
)
