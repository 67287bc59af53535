"""Session files: write, read, repair, replay."""

from tomoskin.files.session.channels import schema_of
from tomoskin.files.session.info import OWN_FILES, SessionInfo, session_info
from tomoskin.files.session.layout import (
    Truth,
)
from tomoskin.files.session.message_log import MessageLog, errors_of
from tomoskin.files.session.playback import Timeline, read_timeline
from tomoskin.files.session.recorder import (
    BoardInfo,
    RawRead,
    Recorder,
    RunMessage,
    RunSettings,
)
from tomoskin.files.session.repair import Lost, Repaired, repair, split, split_targets
from tomoskin.files.session.replay import ReplayTransport, parse_replay
from tomoskin.files.session.replayed import (
    Session,
    as_recorded,
    reconstruct_session,
    recorded_calibrations,
    replayed,
    session_touches,
)
from tomoskin.files.session.scanned import (
    Advance,
    Block,
    all_blocks,
    first_scan,
    idle_count,
    no_report,
    press_positions,
    read_session,
    recording_of,
)
from tomoskin.files.session.session_reader import (
    SessionReader,
    indexed_frames,
    message_counts,
    skins_in,
)
from tomoskin.files.session.session_writer import SessionWriter, robot_logs

__all__ = [
    "OWN_FILES",
    "Advance",
    "Block",
    "BoardInfo",
    "Lost",
    "MessageLog",
    "RawRead",
    "Recorder",
    "Repaired",
    "ReplayTransport",
    "RunMessage",
    "RunSettings",
    "Session",
    "SessionInfo",
    "SessionReader",
    "SessionWriter",
    "Timeline",
    "Truth",
    "all_blocks",
    "as_recorded",
    "errors_of",
    "first_scan",
    "idle_count",
    "indexed_frames",
    "message_counts",
    "no_report",
    "parse_replay",
    "press_positions",
    "read_session",
    "read_timeline",
    "reconstruct_session",
    "recorded_calibrations",
    "recording_of",
    "repair",
    "replayed",
    "robot_logs",
    "schema_of",
    "session_info",
    "session_touches",
    "skins_in",
    "split",
    "split_targets",
]
