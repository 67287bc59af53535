"""Session files: write, read, repair, replay."""

from tomoskin.recording.blocks import Advance, Block, Rows, all_blocks
from tomoskin.recording.channels import schema_of
from tomoskin.recording.documents import encode_json, touch_row, touches_message
from tomoskin.recording.foxglove import grid_message, log_message, scene_message
from tomoskin.recording.info import SessionInfo, session_info
from tomoskin.recording.layout import Mark, MarkedFrame
from tomoskin.recording.recorder import Recorder
from tomoskin.recording.repair import Lost, Repaired, repair
from tomoskin.recording.replay import ReplayTransport, open_replay, parse_replay
from tomoskin.recording.replayed import advance, as_recorded, replayed
from tomoskin.recording.run_messages import (
    BoardInfo,
    RawRead,
    RunMessage,
    RunSettings,
    event_of,
)
from tomoskin.recording.session_reader import RecordedTouches, SessionReader, Truth
from tomoskin.recording.timeline import Span, Timeline, read_timeline
from tomoskin.recording.whole import read_session, recording_of
from tomoskin.recording.writer import SessionWriter

__all__ = [
    "Advance",
    "Block",
    "BoardInfo",
    "Lost",
    "Mark",
    "MarkedFrame",
    "RawRead",
    "RecordedTouches",
    "Recorder",
    "Repaired",
    "ReplayTransport",
    "Rows",
    "RunMessage",
    "RunSettings",
    "SessionInfo",
    "SessionReader",
    "SessionWriter",
    "Span",
    "Timeline",
    "Truth",
    "advance",
    "all_blocks",
    "as_recorded",
    "encode_json",
    "event_of",
    "grid_message",
    "log_message",
    "open_replay",
    "parse_replay",
    "read_session",
    "read_timeline",
    "recording_of",
    "repair",
    "replayed",
    "scene_message",
    "schema_of",
    "session_info",
    "touch_row",
    "touches_message",
]
