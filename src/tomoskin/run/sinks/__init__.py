"""Where results go while they are made: Foxglove, MQTT, LSL, ROS 2, and others by name."""

from tomoskin.files.messages import (
    Contact as Contact,
    Contacts as Contacts,
    Item as Item,
    Naming as Naming,
    Stream as Stream,
)
from tomoskin.run.sinks.joint_states import joint_states as joint_states
from tomoskin.run.sinks.sink import (
    Sink as Sink,
    SinkConsumer as SinkConsumer,
    SinkReport as SinkReport,
    make_sink as make_sink,
    sink_names as sink_names,
    sink_report as sink_report,
    sink_worker as sink_worker,
)
