"""Where results go while they are made: Foxglove, MQTT, LSL, Zenoh, ROS 2, and others by name."""

from tomoskin.sink.outlet import Outlets, SinkReport
from tomoskin.sink.registry import make_sink, sink_names
from tomoskin.sink.sink import Item, Moment, Sink, Stream

__all__ = ["Item", "Moment", "Outlets", "Sink", "SinkReport", "Stream", "make_sink", "sink_names"]
