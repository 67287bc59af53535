"""Where results go while they are made: Foxglove, MQTT, LSL, ROS 2, and others by name."""

from tomoskin.files.messages import Contact, Contacts, Item, Naming, Stream
from tomoskin.run.sinks.joint_states import joint_states
from tomoskin.run.sinks.sink import (
    Sink,
    SinkConsumer,
    SinkReport,
    make_sink,
    sink_names,
    sink_report,
    sink_worker,
)

__all__ = [
    "Contact",
    "Contacts",
    "Item",
    "Naming",
    "Sink",
    "SinkConsumer",
    "SinkReport",
    "Stream",
    "joint_states",
    "make_sink",
    "sink_names",
    "sink_report",
    "sink_worker",
]
