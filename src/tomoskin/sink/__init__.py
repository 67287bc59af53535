"""Where results go while they are made: Foxglove, MQTT, LSL, Zenoh, ROS 2, and others by name."""

from tomoskin.sink.bag import write_bag
from tomoskin.sink.consumer import (
    SinkConsumer,
    SinkReport,
    make_sink,
    sink_names,
    sink_report,
    sink_worker,
)
from tomoskin.sink.contact import Contact, Contacts, contacts_of
from tomoskin.sink.listener import ContactListener
from tomoskin.sink.naming import Naming
from tomoskin.sink.rerun import write_rerun
from tomoskin.sink.sink import Item, Moment, Sink, Stream, epoch, raster
from tomoskin.sink.worker import Capacity, Consumer, Worker, stop_workers

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
