"""One frame as it leaves the program, and the messages of other programs made of it."""

from tomoskin.files.messages.contacts import (
    NO_REFERENCE as NO_REFERENCE,
    Contact as Contact,
    Contacts as Contacts,
    event_content as event_content,
    event_of as event_of,
    happenings as happenings,
    own_touches as own_touches,
    time_of as time_of,
    touch_row as touch_row,
    without_frame as without_frame,
)
from tomoskin.files.messages.deformation import (
    DEFORMATION_COLUMNS as DEFORMATION_COLUMNS,
    DEFORMATION_KINDS as DEFORMATION_KINDS,
    DEFORMATION_UNITS as DEFORMATION_UNITS,
    DeformationSpan as DeformationSpan,
    DeformedFrame as DeformedFrame,
    deformation_content as deformation_content,
    deformation_numbers as deformation_numbers,
    deformation_of as deformation_of,
    deformation_rows as deformation_rows,
    deformation_spans as deformation_spans,
    deformation_state as deformation_state,
)
from tomoskin.files.messages.foxglove_records import (
    TEXT_COLOUR as TEXT_COLOUR,
    TEXT_HEIGHT as TEXT_HEIGHT,
    grid_message as grid_message,
    log_message as log_message,
    scene_message as scene_message,
    touch_colour as touch_colour,
    touch_width as touch_width,
)
from tomoskin.files.messages.place import FRAME as FRAME, LinkPose as LinkPose, Place as Place
from tomoskin.files.messages.reporter import Every as Every, Item as Item, Reporter as Reporter
from tomoskin.files.messages.stream import (
    NAMES as NAMES,
    Naming as Naming,
    Stream as Stream,
    epoch as epoch,
    raster as raster,
    row_labels as row_labels,
)
