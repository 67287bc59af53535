"""Interchange, foreign files, tables, pictures and films."""

from tomoskin.formats.alpha_picture import write_choices
from tomoskin.formats.design_picture import write_promise
from tomoskin.formats.display import Display, circular_average
from tomoskin.formats.exports.hdf5 import write_hdf5
from tomoskin.formats.exports.matlab import write_matlab
from tomoskin.formats.exports.movie import FILMS
from tomoskin.formats.exports.table import write_csv, write_parquet
from tomoskin.formats.interchange import write_interchange
from tomoskin.formats.labelled_set import is_done, join_shards, shard_path, write_whole
from tomoskin.formats.merit_picture import write_merit, write_merit_table
from tomoskin.formats.picture import MOST_PANELS, Panel, plot, rendered, write_picture
from tomoskin.formats.reader import is_session, read_recording
from tomoskin.formats.session_export import WRITERS, Export, omitted
from tomoskin.formats.touch_csv import write_touches
from tomoskin.formats.vtu import series_files, write_series, write_vtu

__all__ = [
    "FILMS",
    "MOST_PANELS",
    "WRITERS",
    "Display",
    "Export",
    "Panel",
    "circular_average",
    "is_done",
    "is_session",
    "join_shards",
    "omitted",
    "plot",
    "read_recording",
    "rendered",
    "series_files",
    "shard_path",
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
    "write_touches",
    "write_vtu",
    "write_whole",
]
