"""Recordings: sessions, interchange, import; pictures and files of their images."""

from tomoskin.session.alpha_picture import write_choices
from tomoskin.session.interchange import write_interchange
from tomoskin.session.labelled_set import is_done, join_shards, shard_path, write_whole
from tomoskin.session.layout import Mark, MarkedFrame
from tomoskin.session.picture import MOST_PANELS, Panel, write_picture
from tomoskin.session.reader import read_recording
from tomoskin.session.recorder import Recorder
from tomoskin.session.recording import Recording
from tomoskin.session.session_reader import (
    RecordedTouches,
    SessionReader,
    Truth,
    read_session,
)
from tomoskin.session.touch_csv import write_touches
from tomoskin.session.vtu import write_vtu
from tomoskin.session.writer import SessionWriter

__all__ = [
    "MOST_PANELS",
    "Mark",
    "MarkedFrame",
    "Panel",
    "RecordedTouches",
    "Recorder",
    "Recording",
    "SessionReader",
    "SessionWriter",
    "Truth",
    "is_done",
    "join_shards",
    "read_recording",
    "read_session",
    "shard_path",
    "write_choices",
    "write_interchange",
    "write_picture",
    "write_touches",
    "write_vtu",
    "write_whole",
]
