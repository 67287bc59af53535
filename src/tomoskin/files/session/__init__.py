"""Session files: write, read, repair, replay."""

from tomoskin.files.session.channels import schema_of as schema_of
from tomoskin.files.session.explanation import Explanation as Explanation, explain as explain
from tomoskin.files.session.info import (
    OWN_FILES as OWN_FILES,
    SessionInfo as SessionInfo,
    session_info as session_info,
)
from tomoskin.files.session.layout import Truth as Truth
from tomoskin.files.session.playback import Timeline as Timeline, read_timeline as read_timeline
from tomoskin.files.session.recorder import (
    BoardInfo as BoardInfo,
    RawRead as RawRead,
    Recorder as Recorder,
    RunMessage as RunMessage,
    RunSettings as RunSettings,
)
from tomoskin.files.session.repair import (
    Lost as Lost,
    Repaired as Repaired,
    repair as repair,
    split as split,
    split_targets as split_targets,
)
from tomoskin.files.session.replay import (
    ReplayTransport as ReplayTransport,
    parse_replay as parse_replay,
)
from tomoskin.files.session.replayed import (
    Session as Session,
    as_recorded as as_recorded,
    reconstruct_session as reconstruct_session,
    recorded_calibrations as recorded_calibrations,
    replayed as replayed,
    session_deformations as session_deformations,
    session_touches as session_touches,
)
from tomoskin.files.session.scanned import (
    Advance as Advance,
    Block as Block,
    all_blocks as all_blocks,
    first_scan as first_scan,
    idle_count as idle_count,
    no_report as no_report,
    press_positions as press_positions,
    read_session as read_session,
    recording_of as recording_of,
)
from tomoskin.files.session.session_reader import (
    SessionReader as SessionReader,
    indexed_frames as indexed_frames,
    message_counts as message_counts,
    skins_in as skins_in,
)
from tomoskin.files.session.session_writer import (
    MessageLog as MessageLog,
    SessionWriter as SessionWriter,
    errors_of as errors_of,
    robot_logs as robot_logs,
)
