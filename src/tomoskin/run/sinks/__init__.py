"""Where results go while they are made: Foxglove, MQTT, LSL, Zenoh, ROS 2, and others by name."""

from tomoskin.run.sinks.bag import write_bag
from tomoskin.run.sinks.consumer import (
    SinkConsumer,
    SinkReport,
    make_sink,
    sink_names,
    sink_report,
    sink_worker,
)
from tomoskin.run.sinks.contact import Contact, Contacts, contacts_of
from tomoskin.run.sinks.listener import ContactListener
from tomoskin.run.sinks.naming import Naming
from tomoskin.run.sinks.rerun import write_rerun
from tomoskin.run.sinks.sink import Item, Moment, Sink, Stream, epoch, raster
from tomoskin.run.sinks.worker import Capacity, Consumer, Worker, stop_workers

__all__ = [
    "Capacity",
    "Consumer",
    "Contact",
    "ContactListener",
    "Contacts",
    "Item",
    "Moment",
    "Naming",
    "Sink",
    "SinkConsumer",
    "SinkReport",
    "Stream",
    "Worker",
    "contacts_of",
    "epoch",
    "make_sink",
    "raster",
    "sink_names",
    "sink_report",
    "sink_worker",
    "stop_workers",
    "write_bag",
    "write_rerun",
]
