"""Recordings of other programs and instruments, their electrodes and signs brought to ours."""

from tomoskin.files.imports.interchange import (
    BOARD_KNOWN as BOARD_KNOWN,
    column_names as column_names,
    read_columns as read_columns,
    write_interchange as write_interchange,
)
from tomoskin.files.imports.reader import (
    Format as Format,
    is_session as is_session,
    read_recording as read_recording,
)
from tomoskin.files.imports.tables import (
    checked_currents as checked_currents,
    voltages_of as voltages_of,
)
