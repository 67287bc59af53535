"""Recordings, images and touches in the formats of other programs; pictures and films."""

from tomoskin.files.exports.curves import (
    write_choices,
    write_merit,
    write_merit_table,
    write_promise,
)
from tomoskin.files.exports.display import Display
from tomoskin.files.exports.export import Export
from tomoskin.files.exports.matlab_file import write_matlab
from tomoskin.files.exports.picture import FILMS, MOST_PANELS, Panel, plot, write_picture
from tomoskin.files.exports.published import RerunView, rerun_recording
from tomoskin.files.exports.session_export import WRITERS, export_touches, omitted
from tomoskin.files.exports.session_table import write_csv, write_hdf5, write_parquet, write_touches
from tomoskin.files.exports.vtu import series_files, write_series, write_vtu
from tomoskin.files.imports import write_interchange

__all__ = [
    "FILMS",
    "MOST_PANELS",
    "WRITERS",
    "Display",
    "Export",
    "Panel",
    "RerunView",
    "export_touches",
    "omitted",
    "plot",
    "rerun_recording",
    "series_files",
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
]
