"""A file of all skins of a robot → one session file for each; the robot's is only read."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, closing
from pathlib import Path

from mcap.records import Attachment, Chunk, Metadata

from tomoskin.core import DataError, Output, StrPath, check_outputs, written
from tomoskin.files.session.blocks import Advance, no_report
from tomoskin.files.session.channels import CHANNELS, SCHEMAS, SPAN, TOPICS
from tomoskin.files.session.container import ContainerWriter
from tomoskin.files.session.mcap_records import messages_in
from tomoskin.files.session.message_log import LIBRARY, errors_of
from tomoskin.files.session.repair import Stretch, stretches
from tomoskin.files.session.session_writer import ABOUT, SKINS


def split_names(source: StrPath) -> tuple[str, ...]:
    """Names of the skins in a robot's recording. DataError where it is none."""
    source = Path(source)
    about = next(
        (r.metadata for r in _about(source) if isinstance(r, Metadata) and r.name == ABOUT), {}
    )
    if SKINS not in about:
        raise DataError("is not a recording of several skins", where=str(source))
    return tuple(about[SKINS].split())


def split_targets(source: StrPath) -> dict[str, Path]:
    """The files that a split makes, by the names of the skins."""
    source = Path(source)
    return {name: source.with_stem(f"{source.stem}-{name}") for name in split_names(source)}


def split(source: StrPath, advance: Advance = no_report) -> dict[str, int]:
    """Write the session of each skin to a file of its own; messages by the names of the skins.

    What is whole in a torn or damaged file is kept.

    Raises
    ------
    OutputError
        When one of :func:`split_targets` exists.
    DataError
        When the file is no recording of several skins, or cannot be read or written.
    """
    source = Path(source)
    targets = split_targets(source)
    check_outputs([Output(path) for path in targets.values()], [source])
    counts = dict.fromkeys(targets, 0)
    with ExitStack() as stack:
        parts = {}
        for name, path in targets.items():
            part = stack.enter_context(written(path))
            output = part.open("wb", buffering=0)
            writer = ContainerWriter(output, LIBRARY, SCHEMAS, CHANNELS)
            parts[name] = stack.enter_context(closing(writer))
        for record in _about(source):
            name, _, rest = record.name.partition("/")
            if name in parts and isinstance(record, Attachment):
                parts[name].attach(rest, record.media_type, record.data, record.log_time)
            elif name in parts and isinstance(record, Metadata):
                parts[name].describe(rest, record.metadata)
        names = tuple(parts)
        for stretch, size in _stretches(source):
            if isinstance(stretch.record, Chunk):
                for message in messages_in(stretch.record, 0):
                    number, channel = divmod(message.channel, SPAN)
                    if number < len(names) and channel in TOPICS:
                        parts[names[number]].message(channel, message.log_time, message.data)
                        counts[names[number]] += 1
            advance(stretch.stop, size)
    return counts


def _stretches(source: Path) -> Iterator[tuple[Stretch, int]]:
    """Each record, and the size of the file."""
    with errors_of(source), source.open("rb") as file:
        size = file.seek(0, 2)
        for stretch in stretches(file, size):
            yield stretch, size


def _about(source: Path) -> Iterator[Attachment | Metadata]:
    """The files inside and the named strings."""
    for stretch, _ in _stretches(source):
        if isinstance(stretch.record, Attachment | Metadata):
            yield stretch.record
