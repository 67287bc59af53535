"""What a session would have had the sink ``ros2`` publish, as a bag of ROS 2, an MCAP file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from tomoskin import __version__
from tomoskin.core import StrPath, written
from tomoskin.extras.ros2.ros_types import definition, encode_cdr, type_hash
from tomoskin.extras.ros2.ros_view import TOPICS, RosMessage, ros_messages
from tomoskin.files.exports import Export, ExportFormat
from tomoskin.files.messages import Naming

if TYPE_CHECKING:
    from mcap.writer import Writer

_BETWEEN = "\n" + 80 * "=" + "\n"


def write_bag(job: Export, path: StrPath) -> None:
    """Write the messages that the sink ``ros2`` would have sent; an image every ``job.every`` s.

    Raises
    ------
    DataError, OutputError
        When the session cannot be replayed, or the file not be written.
    """
    path = Path(path)
    from mcap.writer import CompressionType, Writer

    with written(path, overwrite=job.overwrite) as part, part.open("wb") as file:
        bag = Writer(file, compression=CompressionType.NONE)
        bag.start(profile="ros2", library=f"tomoskin {__version__}")
        channels = {topic: _register(bag, job.stream.naming, topic) for topic in TOPICS}
        for item in job.items():
            for message in ros_messages(job.stream, item):
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


FORMAT = ExportFormat(write_bag, "a bag of ROS 2", of_links=True)
"""What is registered for ``.mcap``."""
