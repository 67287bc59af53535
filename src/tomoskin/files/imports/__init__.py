"""Recordings of other programs and instruments, their electrodes and signs brought to ours."""

from tomoskin.files.imports.interchange import (
    column_names as column_names,
    read_columns as read_columns,
    write_interchange as write_interchange,
)
from tomoskin.files.imports.reader import is_session as is_session, read_recording as read_recording
