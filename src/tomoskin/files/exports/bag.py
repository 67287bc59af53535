"""What a session would have had sinks publish; as a bag of ROS 2, which is an MCAP file."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING

from tomoskin import __version__
from tomoskin.core import StrPath, written
from tomoskin.files.messages import (
    TOPICS,
    Item,
    Naming,
    Reporter,
    RosMessage,
    Stream,
    definition,
    encode_cdr,
    ros_messages,
    type_hash,
)
from tomoskin.files.session import as_recorded
from tomoskin.pipeline import Prepared

if TYPE_CHECKING:
    from mcap.writer import Writer

    from tomoskin.files.exports.session_export import Export

_BETWEEN = "\n" + 80 * "=" + "\n"


def recorded_stream(job: Export, prepared: Prepared) -> Stream:
    """Of the session as it was recorded; ``prepared`` as in the recording."""
    stream = Stream.of(prepared, str(job.session.path), job.session.epoch)
    return replace(stream, replayed=False)  # here events are those of the recording too


def recorded_items(job: Export, prepared: Prepared, stream: Stream) -> Iterator[Item]:
    """What was recorded beside the frames, then each frame's contacts.

    An image every ``job.every`` s.
    """
    events = (event for event in job.session.events() if not event.kind.startswith("touch-"))
    yield from chain(events, job.session.notes())
    reporter = Reporter(stream, image_period=job.every)
    for result in job.results(prepared):
        yield reporter.of(result)


def write_bag(job: Export, path: StrPath) -> None:
    """Write the messages that the sink ``ros2`` would have sent; an image every ``job.every`` s.

    Raises
    ------
    DataError, OutputError
        When the session cannot be replayed, or the file not be written.
    """
    path = Path(path)
    from mcap.writer import CompressionType, Writer

    prepared = as_recorded(job.session)
    stream = recorded_stream(job, prepared)
    with written(path, overwrite=job.overwrite) as part, part.open("wb") as file:
        bag = Writer(file, compression=CompressionType.NONE)
        bag.start(profile="ros2", library=f"tomoskin {__version__}")
        channels = {topic: _register(bag, stream.naming, topic) for topic in TOPICS}
        for item in recorded_items(job, prepared, stream):
            for message in ros_messages(stream, item):
                _put(bag, channels[message.topic], message)
        bag.finish()  # type: ignore[no-untyped-call]


def _register(bag: Writer, naming: Naming, topic: str) -> int:
    kind = TOPICS[topic]
    text = _BETWEEN.join(definition(kind))
    schema = bag.register_schema(kind, "ros2msg", text.encode())
    about = {"offered_qos_profiles": "", "topic_type_hash": type_hash(kind)}
    return bag.register_channel(f"/{naming.topic(topic)}", "cdr", schema, about)


def _put(bag: Writer, channel: int, message: RosMessage) -> None:
    data = encode_cdr(TOPICS[message.topic], message.value)
    bag.add_message(channel, message.stamp, data, message.stamp)
