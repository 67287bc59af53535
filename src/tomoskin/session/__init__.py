"""Recordings: sessions, interchange, import; pictures and files of their images."""

from tomoskin.session.alpha_picture import write_choices
from tomoskin.session.archive import load_arrays, save_arrays
from tomoskin.session.bends_file import (
    BENDS_FILE,
    BendCalibration,
    pack_bends,
    read_bends,
    unpack_bends,
    write_bends,
)
from tomoskin.session.blocks import Rows, all_blocks
from tomoskin.session.calibration import (
    CALIBRATION_FILE,
    Calibration,
    pack_calibration,
    read_calibration,
    unpack_calibration,
    write_calibration,
)
from tomoskin.session.channels import schema_of
from tomoskin.session.colours import AMOUNT, CHANGE, CHANGE_ON_DARK, ColourScale
from tomoskin.session.design_picture import write_promise
from tomoskin.session.display import Display, circular_average
from tomoskin.session.documents import encode_json, touch_row, touches_message
from tomoskin.session.exports.hdf5 import write_hdf5
from tomoskin.session.exports.matlab import write_matlab
from tomoskin.session.exports.movie import WRITERS as FILMS
from tomoskin.session.exports.series import series_files, write_series
from tomoskin.session.exports.table import write_csv, write_parquet
from tomoskin.session.foxglove import grid_message, log_message, scene_message
from tomoskin.session.info import SessionInfo, session_info
from tomoskin.session.interchange import write_interchange
from tomoskin.session.labelled_set import is_done, join_shards, shard_path, write_whole
from tomoskin.session.layout import Mark, MarkedFrame
from tomoskin.session.merit_picture import write_merit, write_merit_table
from tomoskin.session.outputs import RECORDING, Output, check_outputs
from tomoskin.session.picture import MOST_PANELS, Panel, plot, rendered, write_picture
from tomoskin.session.reader import is_session, read_recording
from tomoskin.session.recorder import Recorder
from tomoskin.session.recording import Recording
from tomoskin.session.repair import Lost, Repaired, repair
from tomoskin.session.replay import ReplayTransport, open_replay, parse_replay
from tomoskin.session.session_reader import (
    RecordedTouches,
    SessionReader,
    Truth,
)
from tomoskin.session.states_file import (
    STATES_FILE,
    StatesCalibration,
    pack_states,
    read_states,
    unpack_states,
    write_states,
)
from tomoskin.session.timeline import Span, Timeline, read_timeline
from tomoskin.session.touch_csv import write_touches
from tomoskin.session.vtu import write_vtu
from tomoskin.session.whole import read_session, recording_of
from tomoskin.session.writer import SessionWriter
from tomoskin.session.written import write_text, written

__all__ = [
    "AMOUNT",
    "BENDS_FILE",
    "CALIBRATION_FILE",
    "CHANGE",
    "CHANGE_ON_DARK",
    "FILMS",
    "MOST_PANELS",
    "RECORDING",
    "STATES_FILE",
    "BendCalibration",
    "Calibration",
    "ColourScale",
    "Display",
    "Lost",
    "Mark",
    "MarkedFrame",
    "Output",
    "Panel",
    "RecordedTouches",
    "Recorder",
    "Recording",
    "Repaired",
    "ReplayTransport",
    "Rows",
    "SessionInfo",
    "SessionReader",
    "SessionWriter",
    "Span",
    "StatesCalibration",
    "Timeline",
    "Truth",
    "all_blocks",
    "check_outputs",
    "circular_average",
    "encode_json",
    "grid_message",
    "is_done",
    "is_session",
    "join_shards",
    "load_arrays",
    "log_message",
    "open_replay",
    "pack_bends",
    "pack_calibration",
    "pack_states",
    "parse_replay",
    "plot",
    "read_bends",
    "read_calibration",
    "read_recording",
    "read_session",
    "read_states",
    "read_timeline",
    "recording_of",
    "rendered",
    "repair",
    "save_arrays",
    "scene_message",
    "schema_of",
    "series_files",
    "session_info",
    "shard_path",
    "touch_row",
    "touches_message",
    "unpack_bends",
    "unpack_calibration",
    "unpack_states",
    "write_bends",
    "write_calibration",
    "write_choices",
    "write_csv",
    "write_hdf5",
    "write_interchange",
    "write_matlab",
    "write_merit",
    "write_merit_table",
    "write_parquet",
    "write_picture",
    "write_promise",
    "write_series",
    "write_states",
    "write_text",
    "write_touches",
    "write_vtu",
    "write_whole",
    "written",
]
