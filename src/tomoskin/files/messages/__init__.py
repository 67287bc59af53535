"""One frame as it leaves the program, and the messages of other programs made of it."""

from tomoskin.files.messages.contacts import (
    NO_REFERENCE,
    Contact,
    Contacts,
    event_content,
    event_of,
    time_of,
    touch_row,
    without_frame,
)
from tomoskin.files.messages.foxglove_records import (
    grid_message,
    log_message,
    scene_message,
    touch_colour,
    touch_width,
)
from tomoskin.files.messages.policy_forms import (
    FIELDS,
    SLOTS,
    PolicyForms,
    PolicyView,
    Slots,
    last_before,
    still_holds,
)
from tomoskin.files.messages.reporter import Every, Item, Reporter
from tomoskin.files.messages.ros_types import (
    NODE_TYPES,
    TYPES,
    Field,
    dds_name,
    definition,
    encode_cdr,
    type_hash,
)
from tomoskin.files.messages.ros_view import KEPT, TOPICS, RosMessage, ros_messages
from tomoskin.files.messages.stream import NAMES, Naming, Stream, epoch, raster, row_labels

__all__ = [
    "FIELDS",
    "KEPT",
    "NAMES",
    "NODE_TYPES",
    "NO_REFERENCE",
    "SLOTS",
    "TOPICS",
    "TYPES",
    "Contact",
    "Contacts",
    "Every",
    "Field",
    "Item",
    "Naming",
    "PolicyForms",
    "PolicyView",
    "Reporter",
    "RosMessage",
    "Slots",
    "Stream",
    "dds_name",
    "definition",
    "encode_cdr",
    "epoch",
    "event_content",
    "event_of",
    "grid_message",
    "last_before",
    "log_message",
    "raster",
    "ros_messages",
    "row_labels",
    "scene_message",
    "still_holds",
    "time_of",
    "touch_colour",
    "touch_row",
    "touch_width",
    "type_hash",
    "without_frame",
]
