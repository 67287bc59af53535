"""A session as a bag of ROS 2: an MCAP file that ``ros2 bag`` and ``rosbags`` take."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING

from tomoskin import __version__
from tomoskin.core import written
from tomoskin.pipeline import Prepared
from tomoskin.recording import as_recorded, indexed_frames, replayed
from tomoskin.sink.cdr import encode_cdr
from tomoskin.sink.naming import Naming
from tomoskin.sink.ros import TOPICS, RosMessage, RosView
from tomoskin.sink.ros_types import definition, type_hash
from tomoskin.sink.sink import Item, Moment, Stream

if TYPE_CHECKING:
    from mcap.writer import Writer

    from tomoskin.formats import Export

_BETWEEN = "\n" + 80 * "=" + "\n"


def write_bag(job: Export, path: Path) -> None:
    """Write the messages that the sink ``ros2`` would have sent; an image every ``job.every`` s.

    Raises
    ------
    DataError, OutputError
        When the session cannot be replayed, or the file not be written.
    """
    from mcap.writer import CompressionType, Writer  # noqa: PLC0415 - no live run needs it

    prepared, naming = as_recorded(job.session), Naming()
    stream = Stream.of(prepared, str(job.session.path), job.session.epoch)
    stream = replace(stream, replayed=False)  # here events are those of the recording too
    view = RosView(stream, naming)
    with written(path, overwrite=job.overwrite) as part, part.open("wb") as file:
        bag = Writer(file, compression=CompressionType.NONE)
        bag.start(profile="ros2", library=f"tomoskin {__version__}")
        channels = {topic: _register(bag, naming, topic) for topic in TOPICS}
        for item in _items(job, prepared):
            for message in view.of(item):
                _put(bag, channels[message.topic], message)
        bag.finish()  # type: ignore[no-untyped-call]


def _items(job: Export, prepared: Prepared) -> Iterator[Item]:
    """What was recorded beside the frames, then each frame's results and what happened in it."""
    told = (event for event in job.session.events() if not event.kind.startswith("touch-"))
    yield from chain(told, job.session.notes())
    total, due = indexed_frames(job.session), float("-inf")
    for done, result in enumerate(replayed(prepared, job.session)):
        job.advance(done, max(done + 1, total))
        shown = result.ready and result.has_image and result.host_time >= due
        if shown:
            due = result.host_time + job.every
        yield Moment.of(result, with_image=shown)


def _register(bag: Writer, naming: Naming, topic: str) -> int:
    kind = TOPICS[topic]
    text = _BETWEEN.join(definition(kind))
    schema = bag.register_schema(kind, "ros2msg", text.encode())
    about = {"offered_qos_profiles": "", "topic_type_hash": type_hash(kind)}
    return bag.register_channel(f"/{naming.topic(topic)}", "cdr", schema, about)


def _put(bag: Writer, channel: int, message: RosMessage) -> None:
    data = encode_cdr(TOPICS[message.topic], message.value)
    bag.add_message(channel, message.stamp, data, message.stamp)
