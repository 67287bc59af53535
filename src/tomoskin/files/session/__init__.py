"""Session files: write, read, repair, replay."""

from tomoskin.core import encode_json
from tomoskin.files.session.blocks import (
    Advance,
    Block,
    Rows,
    all_blocks,
    no_report,
    press_positions,
    read_session,
    recording_of,
)
from tomoskin.files.session.channels import schema_of
from tomoskin.files.session.foxglove import (
    grid_message,
    log_message,
    scene_message,
    touch_colour,
    touch_width,
)
from tomoskin.files.session.info import OWN_FILES, SessionInfo, session_info
from tomoskin.files.session.layout import (
    RecordedTouches,
    Truth,
    touch_row,
    touches_message,
)
from tomoskin.files.session.message_log import errors_of
from tomoskin.files.session.playback import Timeline, read_timeline
from tomoskin.files.session.recorder import (
    BoardInfo,
    RawRead,
    Recorder,
    RunMessage,
    RunSettings,
    event_of,
)
from tomoskin.files.session.repair import Lost, Repaired, repair
from tomoskin.files.session.replay import ReplayTransport, open_replay, parse_replay
from tomoskin.files.session.replayed import (
    as_recorded,
    reconstruct_session,
    recorded_calibrations,
    replayed,
    told_touches,
)
from tomoskin.files.session.robot_log import LogPart, RobotLog
from tomoskin.files.session.scanned import first_scan, idle_count, scanned_touches
from tomoskin.files.session.session import Session
from tomoskin.files.session.session_reader import (
    SessionReader,
    end_time,
    indexed_frames,
    message_counts,
    start_time,
    tick_rate,
    touches_before,
)
from tomoskin.files.session.session_writer import Log, SessionWriter
from tomoskin.files.session.split import split, split_names, split_targets
from tomoskin.sensing.track import Span

__all__ = [
    "OWN_FILES",
    "Advance",
    "Block",
    "BoardInfo",
    "Log",
    "LogPart",
    "Lost",
    "RawRead",
    "RecordedTouches",
    "Recorder",
    "Repaired",
    "ReplayTransport",
    "RobotLog",
    "Rows",
    "RunMessage",
    "RunSettings",
    "Session",
    "SessionInfo",
    "SessionReader",
    "SessionWriter",
    "Span",
    "Timeline",
    "Truth",
    "all_blocks",
    "as_recorded",
    "encode_json",
    "end_time",
    "errors_of",
    "event_of",
    "first_scan",
    "grid_message",
    "idle_count",
    "indexed_frames",
    "log_message",
    "message_counts",
    "no_report",
    "open_replay",
    "parse_replay",
    "press_positions",
    "read_session",
    "read_timeline",
    "reconstruct_session",
    "recorded_calibrations",
    "recording_of",
    "repair",
    "replayed",
    "scanned_touches",
    "scene_message",
    "schema_of",
    "session_info",
    "split",
    "split_names",
    "split_targets",
    "start_time",
    "tick_rate",
    "told_touches",
    "touch_colour",
    "touch_row",
    "touch_width",
    "touches_before",
    "touches_message",
]
