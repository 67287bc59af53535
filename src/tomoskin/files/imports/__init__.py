"""Recordings of other programs and instruments, their electrodes and signs brought to ours."""

from tomoskin.files.imports.csv_table import column_names
from tomoskin.files.imports.interchange import write_interchange
from tomoskin.files.imports.reader import is_session, read_recording

__all__ = ["column_names", "is_session", "read_recording", "write_interchange"]
