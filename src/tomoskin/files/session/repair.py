"""What is whole in a session file → a mended one, or one for each of several skins.

The file itself is only read.
"""

from __future__ import annotations

import math
import re
from collections import Counter, deque
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

from mcap import records
from mcap.opcode import Opcode
from mcap.records import Attachment, Chunk, DataEnd, McapRecord, Metadata

from tomoskin.core import (
    EMPTY,
    MAGIC,
    DataError,
    Output,
    SkinError,
    StrPath,
    check_is_file,
    check_outputs,
    open_input,
    written,
)
from tomoskin.files.session import mcap_records
from tomoskin.files.session.channels import CHANNELS, SCHEMAS, SPAN, TOPICS
from tomoskin.files.session.container import ContainerWriter
from tomoskin.files.session.layout import host_time_of
from tomoskin.files.session.scanned import Advance, no_report
from tomoskin.files.session.session_reader import epoch_of
from tomoskin.files.session.session_writer import (
    ABOUT,
    LIBRARY,
    OLD_INDEX_FILE,
    SKIN_FILE,
    SKINS,
    about_session,
    errors_of,
)
from tomoskin.model.skin import Skin

_WINDOW = 1 << 20
_BEGINNING = re.compile(rb"(?=[\x06\x09\x0c].{3}\x00{5})", re.DOTALL)
"""Kind and length of a chunk, attachment or named strings of up to 16 MiB."""

_KINDS: dict[int, type[McapRecord]] = {
    Opcode[name]: getattr(records, "".join(map(str.title, name.split("_"))))
    for name in Opcode.__members__
}
"""What a record of each kind is decoded as."""

_SAME_EPOCH = 1e-6
"""So many s may lie between an epoch as it is written and as the log times of messages tell it."""


@dataclass(frozen=True, slots=True)
class Lost:
    """A stretch of bytes that nothing could be made of, and the log times (ns) around it."""

    start: int
    stop: int
    after: int
    before: int | None


@dataclass
class Repaired:
    """What a repair kept and what it did not.

    ``messages`` kept by topic; ``chunks`` kept; ``lost`` stretches of the file; ``ended`` whether
    the file had its end.
    """

    path: Path
    messages: Counter[str] = field(default_factory=Counter)
    chunks: int = 0
    lost: list[Lost] = field(default_factory=list)
    ended: bool = False


class Stretch(NamedTuple):
    """Bytes of a file, and the record that they are; None where they are none."""

    start: int
    stop: int
    record: McapRecord | None


def repair(
    source: StrPath, target: StrPath, *, skin: Skin | None = None, advance: Advance = no_report
) -> Repaired:
    """Write every whole chunk of ``source`` to the new file ``target``, which appears at the end.

    Parameters
    ----------
    skin
        Used where the file's own skin is lost.

    Raises
    ------
    OutputError
        When the target exists or cannot be made.
    DataError
        When the source cannot be read or nothing in it is whole, the target cannot be written, or
        the skin is lost and none is given.
    """
    source, target = Path(source), Path(target)
    check_outputs([Output(target)], [source])
    check_is_file(source)
    result = Repaired(target)
    about, attachments = _front(source, skin, lambda done, size: advance(done, 2 * size))
    with _new_file(target) as mended:
        mended.describe(ABOUT, about)
        for item in attachments:
            mended.attach(item.name, item.media_type, item.data)
        _copy(source, mended, result, lambda done, size: advance(size + done, 2 * size))
        if not result.chunks:
            raise DataError("holds no whole chunk, so nothing can be recovered", where=str(source))
    return result


def split_targets(source: StrPath) -> dict[str, Path]:
    """The files that a split makes, by the names of the skins; DataError where there is one."""
    source = Path(source)
    about: dict[str, str] = next(
        (r.metadata for r in _about(source) if isinstance(r, Metadata) and r.name == ABOUT), {}
    )
    if SKINS not in about:
        raise DataError("is not a recording of several skins", where=str(source))
    return {name: source.with_stem(f"{source.stem}-{name}") for name in about[SKINS].split()}


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
    counts, names = dict.fromkeys(targets, 0), tuple(targets)
    with ExitStack() as stack:
        parts = {name: stack.enter_context(_new_file(path)) for name, path in targets.items()}
        for record in _about(source):
            name, _, rest = record.name.partition("/")
            if name in parts and isinstance(record, Attachment):
                parts[name].attach(rest, record.media_type, record.data, record.log_time)
            elif name in parts and isinstance(record, Metadata):
                parts[name].describe(rest, record.metadata)
        for stretch in _stretches(source, advance):
            for message in _messages(stretch.record):
                number, channel = divmod(message.channel, SPAN)
                if number < len(names) and channel in TOPICS:
                    parts[names[number]].message(channel, message.log_time, message.data)
                    counts[names[number]] += 1
    return counts


@contextmanager
def _new_file(path: Path) -> Iterator[ContainerWriter]:
    """A session file that appears when the block ends without an error."""
    with written(path) as part:
        output = part.open("wb", buffering=0)
        with closing(ContainerWriter(output, LIBRARY, SCHEMAS, CHANNELS)) as container:
            yield container


def _stretches(source: Path, advance: Advance = no_report) -> Iterator[Stretch]:
    """Each stretch of a file; says where it is in bytes, in long damage too."""
    with errors_of(source), open_input(source) as file:
        if not (size := file.seek(0, 2)):
            raise DataError(EMPTY, where=str(source))
        for stretch in stretches(file, size, advance):
            yield stretch
            advance(stretch.stop, size)


def _about(source: Path) -> Iterator[Any]:
    """The files inside and the named strings."""
    for stretch in _stretches(source):
        if isinstance(stretch.record, Attachment | Metadata):
            yield stretch.record


def _messages(record: McapRecord | None) -> Iterator[mcap_records.LoggedMessage]:
    """Those of a chunk; of anything else there are none."""
    if isinstance(record, Chunk):
        yield from mcap_records.messages_in(record, 0)


def stretches(file: BinaryIO, size: int, advance: Advance) -> Iterator[Stretch]:
    """The records of a file up to its DATA END, and what is lost between.

    It goes record by record, and where one is damaged on to the next whole one of data. That may
    begin before the damage: a length that is wrong, of a record without a CRC, swallows nothing.
    """
    place = sure = len(MAGIC) if _read(file, 0, len(MAGIC)) == MAGIC else 0
    while place < size:
        opcode, stop = _head(file, place, size)
        record = _record(opcode, _read(file, place, stop - place))
        if record is None:
            stop = _next_record(file, sure, place, size, advance)
            yield Stretch(place if stop > place else sure, stop, None)
        else:
            yield Stretch(place, stop, record)
        if isinstance(record, DataEnd):
            return
        if isinstance(record, Chunk | Attachment):
            sure = stop
        place = stop


def _front(
    source: Path, skin: Skin | None, advance: Advance
) -> tuple[dict[str, str], list[Attachment]]:
    """The named strings and the attachments, wherever they are in the file.

    The strings have no CRC: they are made again of the skin, and of the clock as messages tell it.
    """
    about: dict[str, str] = {}
    attachments: dict[str, Attachment] = {}
    where = str(source)
    is_session, epoch = False, math.inf
    for _, _, record in _stretches(source, advance):
        is_session |= isinstance(record, Chunk | Attachment | Metadata)
        if isinstance(record, Attachment) and record.name != OLD_INDEX_FILE:
            attachments[record.name] = record
        elif isinstance(record, Metadata) and record.name == ABOUT:
            about = record.metadata
        elif isinstance(record, Chunk):
            epoch = min(epoch, _earliest_epoch(record))
    if SKINS in about:
        hint = (
            f"tomoskin session split {where} recovers all whole chunks, in one file for each skin"
        )
        raise DataError("holds the sessions of several skins", where=where, hint=hint)
    if not is_session:
        raise DataError("holds no part of a session, so nothing can be recovered", where=where)
    skin = skin or _skin_of(attachments.get(SKIN_FILE), about, where)
    data = skin.to_toml().encode()
    attachments[SKIN_FILE] = Attachment(0, 0, SKIN_FILE, "application/toml", data)
    return about_session(skin, _epoch(about, epoch)), list(attachments.values())


def _skin_of(attachment: Attachment | None, about: Mapping[str, str], where: str) -> Skin:
    """The skin in the file, or the built-in one that its strings name."""
    if attachment is not None:
        try:
            return Skin.from_toml(attachment.data.decode(), source=f"{where}, {SKIN_FILE}")
        except (SkinError, UnicodeDecodeError):
            pass  # the same as no skin
    if (name := about.get("skin", "")) in Skin.names():
        skin = Skin.load(name)
        if skin.identity == about.get("skin_identity"):
            return skin
    raise DataError(
        "its skin is lost, so nothing can be recovered without it",
        where=where,
        hint="give the skin: --skin",
    )


def _earliest_epoch(chunk: Chunk) -> float:
    """Log time less host time, s, where it is least; infinite where no message tells.

    Frames from before the recording are logged when it begins, later than they were.
    """
    ages = ((m.log_time, host_time_of(m.data)) for m in mcap_records.messages_in(chunk, 0))
    differences = ((log - round(1e9 * host)) / 1e9 for log, host in ages if math.isfinite(host))
    return min(differences, default=math.inf)


def _epoch(about: Mapping[str, str], stated: float) -> float:
    """The epoch as it is written, unless what the messages have ``stated`` differs."""
    own = epoch_of(about)
    if own is not None and (math.isinf(stated) or abs(own - stated) < _SAME_EPOCH):
        return own
    return 0.0 if math.isinf(stated) else stated


def _copy(source: Path, container: ContainerWriter, result: Repaired, advance: Advance) -> None:
    """Write the messages of every chunk, and note what is lost."""
    after = 0
    for start, stop, record in _stretches(source, advance):
        if isinstance(record, Chunk):
            if result.lost and result.lost[-1].before is None:
                result.lost[-1] = replace(result.lost[-1], before=record.message_start_time)
            result.chunks, after = result.chunks + 1, record.message_end_time
        elif record is None:
            result.lost.append(Lost(start, stop, after, None))
        for message in _messages(record):
            if message.channel in TOPICS:
                container.message(message.channel, message.log_time, message.data)
                result.messages[TOPICS[message.channel]] += 1
        result.ended |= isinstance(record, DataEnd)


def _head(file: BinaryIO, place: int, size: int) -> tuple[int, int]:
    """Kind and end of the record at ``place``; its end is ``place`` where there can be none."""
    head = _read(file, place, mcap_records.PREFIX.size)
    if len(head) < mcap_records.PREFIX.size:
        return 0, place
    opcode, length = mcap_records.PREFIX.unpack(head)
    stop = place + mcap_records.PREFIX.size + int(length)
    fits = opcode in _KINDS and length <= mcap_records.LARGEST and stop <= size
    return opcode, stop if fits else place


def _record(opcode: int, data: bytes) -> McapRecord | None:
    """What ``data`` is, when it is whole."""
    try:
        if opcode == Opcode.CHUNK:
            chunk = mcap_records.decode_chunk(data)
            deque(
                mcap_records.messages_in(chunk, 0), maxlen=0
            )  # ValueError where they do not add up
            return None if chunk.compression else chunk
        return mcap_records.decode(_KINDS[opcode], data) if data else None
    except ValueError:
        return None


def _next_record(file: BinaryIO, place: int, beyond: int, size: int, advance: Advance) -> int:
    """Where from ``place`` on a whole record of data begins that ends ``beyond`` it, or the end."""
    while place < size:
        window = _read(file, place, _WINDOW + mcap_records.PREFIX.size)
        for match in _BEGINNING.finditer(window):
            start = place + match.start()
            opcode, stop = _head(file, start, size)
            if stop > beyond and _record(opcode, _read(file, start, stop - start)) is not None:
                return start
        place += _WINDOW
        advance(min(place, size), size)
    return size


def _read(file: BinaryIO, place: int, length: int) -> bytes:
    file.seek(place)
    return file.read(length)
