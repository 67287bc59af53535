"""Files that are cut, damaged, foreign or hostile: whole frames or an error, never a wrong one."""

from __future__ import annotations

import os
import random
import signal
import struct
import subprocess
import sys
import tracemalloc
from pathlib import Path

import pytest
from hypothesis import given, settings, strategies as st
from mcap.opcode import Opcode
from mcap.writer import CompressionType, Writer

from files.session.runs import SKIN, frame_of, same_frame, write_all, write_frames
from tomoskin.core import MAGIC, DataError, encode_json
from tomoskin.files.imports import read_recording
from tomoskin.files.session import (
    SessionReader,
    SessionWriter,
    message_counts,
    repair,
    session_info,
)
from tomoskin.files.session.channels import TOUCHES
from tomoskin.files.session.mcap_records import PREFIX

ROOT = Path(__file__).resolve().parents[2]
RATE = 10.0
"""Frames per second of the small file: a chunk holds ten."""


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    """A few frames in a few chunks."""
    return write_frames(tmp_path_factory.mktemp("small") / "small.mcap", 60, rate=RATE)


def frames_in(path):
    """Frames that can be read before the reader stops, and its error."""
    found = []
    try:
        with SessionReader(path) as session:
            for item in session.frames():
                found.append(item.frame)
    except DataError as error:
        return found, error
    return found, None


def assert_true(found):
    """Each of ``found`` is a frame that was written, in order."""
    sequences = [frame.sequence for frame in found]
    assert sequences == sorted(set(sequences))
    assert all(same_frame(frame, frame_of(frame.sequence, rate=RATE)) for frame in found)


def chunks(data):
    """(start, end, frames) of each chunk's record."""
    for start in record_starts(data):
        opcode, length = PREFIX.unpack_from(data, start)
        stop = start + PREFIX.size + length
        if opcode == Opcode.CHUNK:
            place, count = start + PREFIX.size + 28 + 4 + 8, 0  # times, size, CRC and two lengths
            while place < stop:
                kind, size = PREFIX.unpack_from(data, place)
                place += PREFIX.size
                count += kind == Opcode.MESSAGE and struct.unpack_from("<H", data, place)[0] == 2
                place += size
            yield start, stop, count
        if opcode == Opcode.DATA_END:
            return


def chunk_ends(data):
    """(end of each chunk's record, frames up to there)."""
    count = 0
    return [(stop, count := count + frames) for _, stop, frames in chunks(data)]


def record_starts(data):
    """Offset of every record."""
    place = len(MAGIC)
    while place < len(data) - len(MAGIC):
        yield place
        place += PREFIX.size + PREFIX.unpack_from(data, place)[1]


def some_sizes(data):
    """Around the beginning and in the head of every record, and here and there between."""
    near = {start + shift for start in record_starts(data) for shift in (-1, 0, 1, 5, 9, 20)}
    return sorted(near | set(range(0, len(data), 211)))


@pytest.mark.parametrize(
    "sizes", [some_sizes, pytest.param(lambda data: range(len(data)), marks=pytest.mark.slow)]
)
def test_wherever_it_is_cut_every_whole_chunk_is_read(small, tmp_path, sizes):
    data = small.read_bytes()
    ends = chunk_ends(data)
    assert len(ends) >= 3
    path = tmp_path / "cut.mcap"
    for size in sizes(data):
        path.write_bytes(data[:size])
        found, error = frames_in(path)
        expected = max((count for end, count in ends if end <= size), default=0)
        assert len(found) == expected, size
        assert_true(found)
        if error is not None:
            assert str(path) in str(error)
            assert size < ends[0][0]


def test_a_cut_file_says_that_it_is_cut(small, tmp_path):
    path = tmp_path / "cut.mcap"
    data = small.read_bytes()
    path.write_bytes(data[: len(data) // 2])
    with SessionReader(path) as session:
        list(session.frames())
        assert "is incomplete" in session.torn
    assert session_info(path).torn


@pytest.mark.parametrize("part", range(4))
def test_flipped_bits_never_give_a_wrong_frame(small, tmp_path, part):
    """Every 61st byte, each with another bit."""
    data = small.read_bytes()
    path = tmp_path / "flipped.mcap"
    refused = 0
    places = range(61 * part, len(data), 61 * 4)
    for place in places:
        flipped = bytearray(data)
        flipped[place] ^= 1 << (place % 8)
        path.write_bytes(flipped)
        found, error = frames_in(path)
        assert_true(found)
        if error is None and len(found) < 60:
            with pytest.raises(DataError, match="60 frames were written"):
                read_recording(path)
        refused += error is not None
    assert refused > len(places) // 2


@pytest.mark.parametrize("step", [101, pytest.param(11, marks=pytest.mark.slow)])
def test_flipped_bits_anywhere_are_refused_or_change_nothing(tmp_path, step):
    """Everything but frames, in a file that holds some of each."""
    path = tmp_path / "flipped.mcap"
    data = write_all(tmp_path / "all.mcap").read_bytes()
    expected, _ = everything_in(tmp_path / "all.mcap")
    refused = 0
    for place in range(0, len(data), step):
        flipped = bytearray(data)
        flipped[place] ^= 1 << (place % 8)
        path.write_bytes(flipped)
        found, error = everything_in(path)
        if error is not None:
            assert str(path) in str(error)
            refused += 1
            continue
        assert {topic: found[topic] for topic in found if found[topic] != expected[topic]} in (
            {},
            {"epoch": found["epoch"]},  # a named string has no CRC of its own
        )
    assert refused > len(data) // step // 2


def everything_in(path):
    """What a session holds beside its frames, or why it cannot be read."""
    try:
        return told_by(path), None
    except DataError as error:
        return {}, error


def told_by(path):
    with SessionReader(path) as session:
        return {
            "epoch": session.epoch,
            "skin": session.skin.identity,
            "device": session.device(),
            "clock": session.clock(),
            "settings": session.settings(),
            "events": list(session.events()),
            "notes": list(session.notes()),
            "touches": repr(list(session.touches())),
            "truth": list(session.truth()),
        }


def test_damage_is_located(small, tmp_path):
    data = bytearray(small.read_bytes())
    end, _ = chunk_ends(bytes(data))[1]
    data[end - 100] ^= 0xFF
    path = tmp_path / "damaged.mcap"
    path.write_bytes(data)
    found, error = frames_in(path)
    assert_true(found)
    assert "the CRC of a chunk is wrong" in str(error)
    assert "byte" in error.where
    assert "session repair" in error.hint


@pytest.mark.parametrize("seed", range(20))
def test_repair_keeps_all_but_the_damaged_chunks(small, tmp_path, seed):
    rng = random.Random(seed)
    data = bytearray(small.read_bytes())
    ends = chunk_ends(bytes(data))
    start = ends[0][0]
    broken = set()
    for _ in range(rng.randint(1, 2)):
        place = rng.randrange(start, ends[-1][0])
        length = rng.randint(1, 40)
        data[place : place + length] = rng.randbytes(len(data[place : place + length]))
        broken |= {n for n, (end, _) in enumerate(ends) if place < end + 400} & {
            n for n, (end, _) in enumerate(ends) if n == 0 or ends[n - 1][0] < place + length
        }
    path, mended = tmp_path / "damaged.mcap", tmp_path / "mended.mcap"
    path.write_bytes(data)
    before = path.read_bytes()
    result = repair(path, mended)
    assert path.read_bytes() == before
    found, error = frames_in(mended)
    assert error is None
    assert_true(found)
    counts = [count for _, count in ends]
    sizes = [b - a for a, b in zip([0, *counts], counts, strict=False)]
    assert len(found) >= sum(size for n, size in enumerate(sizes) if n not in broken)
    assert len(found) == 60 or result.lost


def test_repair_of_a_file_without_its_end_keeps_everything_else(tmp_path):
    path = write_all(tmp_path / "whole.mcap")
    data = path.read_bytes()
    cut = tmp_path / "cut.mcap"
    end = data.rindex(PREFIX.pack(Opcode.DATA_END, 4))
    cut.write_bytes(data[: end + 3])  # within that record's head
    result = repair(cut, tmp_path / "mended.mcap")
    assert not result.ended
    with SessionReader(tmp_path / "mended.mcap") as mended, SessionReader(path) as original:
        assert message_counts(mended) == message_counts(original)
        assert mended.epoch == original.epoch
        assert mended.attachments()["calibration.json"] == b"{}"


def test_repair_takes_a_skin_where_the_files_own_is_lost(small, tmp_path):
    nameless = small.read_bytes().replace(b"skin.toml", b"skin.tolm", 1)
    path = tmp_path / "skinless.mcap"
    path.write_bytes(nameless)
    repair(path, tmp_path / "built-in.mcap")  # its strings name a skin that comes with us
    assert len(frames_in(tmp_path / "built-in.mcap")[0]) == 60
    path.write_bytes(nameless.replace(b"textile-disc-8", b"textile-disc-9", 1))
    with pytest.raises(DataError, match=r"skin is lost.*--skin"):
        repair(path, tmp_path / "a.mcap")
    repair(path, tmp_path / "b.mcap", skin=SKIN)
    assert len(frames_in(tmp_path / "b.mcap")[0]) == 60


MUTATIONS = st.lists(
    st.tuples(
        st.integers(0, 400) | st.integers(0, 20_000),
        st.integers(0, 30),
        st.binary(max_size=30) | st.integers(0, 2**32 - 1).map(lambda n: n.to_bytes(4, "little")),
    ),
    min_size=1,
    max_size=3,
)
"""Where, how many bytes are taken out, and what is put there."""


@settings(max_examples=50)
@given(MUTATIONS)
def test_what_is_repaired_opens_and_holds_every_whole_frame(small, mutations):
    data, mended = small.read_bytes(), small.with_name("mended.mcap")
    damaged = bytearray(data)
    for place, length, put in mutations:
        damaged[place : place + length] = put
    path = small.with_name("mutated.mcap")
    path.write_bytes(damaged)
    mended.unlink(missing_ok=True)
    refusal = ""
    try:
        result = repair(path, mended)
    except DataError as error:
        refusal = error.message
    if not mended.exists():
        assert "nothing" in refusal  # is saved
        return
    found, error = frames_in(mended)
    assert error is None
    whole = sum(count for start, stop, count in chunks(data) if data[start:stop] in damaged)
    assert len(found) >= whole
    assert len(found) == 60 or result.lost or not result.ended
    with SessionReader(mended) as session:
        assert session.epoch == pytest.approx(0.0, abs=1e-6)


def test_a_length_that_is_wrong_swallows_nothing(small, tmp_path):
    """Of a record that is not needed: what follows it is."""
    data = bytearray(small.read_bytes())
    (_, end, _), *_ = chunks(bytes(data))
    assert data[end] == Opcode.MESSAGE_INDEX
    data[end + 2] ^= 0x10  # 4 KiB more
    path, mended = tmp_path / "damaged.mcap", tmp_path / "mended.mcap"
    path.write_bytes(data)
    assert repair(path, mended).lost
    assert len(frames_in(mended)[0]) == 60


@pytest.mark.parametrize("written", [b"1000000009.0", b"1000000000.x"])
@pytest.mark.parametrize("frames", [True, False])
def test_the_clock_is_found_again_by_the_messages(tmp_path, written, frames):
    path, mended = tmp_path / "all.mcap", tmp_path / "mended.mcap"
    data = write_all(path).read_bytes()
    if not frames:  # the first chunk alone: how the run was set
        (_, stop, _), *_ = chunks(data)
        data = data[:stop]
    path.write_bytes(data.replace(b"1000000000.0", written, 1))
    repair(path, mended)
    with SessionReader(mended) as session:
        assert session.epoch == pytest.approx(1e9, abs=1e-6)


def test_repair_of_nothing_leaves_nothing(tmp_path):
    path = tmp_path / "x.mcap"
    path.write_bytes(b"nothing at all" * 100)
    for skin in (None, SKIN):
        with pytest.raises(DataError, match="no part of a session"):
            repair(path, tmp_path / "y.mcap", skin=skin)
    with pytest.raises(DataError, match="there is no such file"):
        repair(tmp_path / "z.mcap", tmp_path / "y.mcap")
    assert not (tmp_path / "y.mcap").exists()


def foreign(path, compression=CompressionType.NONE):
    with path.open("wb") as file:
        writer = Writer(file, compression=compression)
        writer.start()
        schema = writer.register_schema("x", "jsonschema", b"{}")
        channel = writer.register_channel("/frames", "json", schema)
        writer.add_message(channel, 1, b"{}", 1)
        writer.finish()
    return path


def test_a_foreign_mcap_is_refused(tmp_path):
    path = foreign(tmp_path / "foreign.mcap")
    with pytest.raises(DataError, match="not a session of tomoskin"):
        read_recording(path)


def test_compressed_chunks_are_refused_before_they_are_unpacked(small, tmp_path):
    """Some other program may have packed it again; a bomb would come so too."""
    path = tmp_path / "packed.mcap"
    with SessionReader(small) as session, path.open("wb") as file:
        writer = Writer(file, chunk_size=1 << 16, compression=CompressionType.ZSTD)
        writer.start()
        about = {"format": "1", "epoch_s": "0.0"}
        writer.add_metadata("tomoskin", about)
        skin = session.attachments()["skin.toml"]
        writer.add_attachment(0, 0, "skin.toml", "application/toml", skin)
        schema = writer.register_schema("tomoskin_msgs/msg/Frame", "ros2msg", b"")
        writer.register_channel("/raw", "cdr", schema)
        channel = writer.register_channel("/frames", "cdr", schema)
        writer.add_message(channel, 0, bytes(50 << 20), 0)
        writer.finish()
    tracemalloc.start()
    with pytest.raises(DataError, match=r"compressed \(zstd\).*mcap decompress"):
        read_recording(path)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 20 << 20


@pytest.mark.parametrize("length", [2**63, 2**40, (64 << 20) + 1])
def test_an_endless_record_is_refused_without_reading_it(small, tmp_path, length):
    path = tmp_path / "endless.mcap"
    path.write_bytes(small.read_bytes()[:39] + PREFIX.pack(Opcode.CHUNK, length) + bytes(1000))
    with pytest.raises(DataError, match=r"damaged|no session"):
        read_recording(path)


@pytest.mark.parametrize(
    ("about", "said"),
    [
        ({"format": "2", "epoch_s": "0"}, "expected a session of format 1, got 2"),
        ({"format": "1", "epoch_s": "soon"}, "the start time of its clock"),
        ({"format": "1", "epoch_s": "0"}, "holds no skin"),
    ],
)
def test_a_session_that_contradicts_itself(tmp_path, about, said):
    path = tmp_path / "x.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        writer.add_metadata("tomoskin", about)
        writer.finish()
    with pytest.raises(DataError, match=said):
        read_recording(path)


# A killed program.

_WRITE = """
import sys
from pathlib import Path
from files.session.runs import frame_of, put, SKIN
from tomoskin.files.session import SessionWriter
with SessionWriter(Path(sys.argv[1]), SKIN) as session:
    frames = [frame_of(n) for n in range(500)]
    number = 0
    from dataclasses import replace
    while True:
        frame = replace(frames[number % 500], sequence=number, host_time=number / 100)
        put(session, frame)
        number += 1
        if number % 10 == 0:
            sys.stdout.write("%d\\n" % number)
            sys.stdout.flush()
"""


def start(code, path):
    """A program of its own that writes to ``path``."""
    return subprocess.Popen(
        [sys.executable, "-c", code, str(path)],
        stdout=subprocess.PIPE,
        text=True,
        cwd=ROOT,
        env=os.environ | {"PYTHONPATH": os.pathsep.join([str(ROOT), *sys.path])},
    )


@pytest.mark.parametrize(
    "seed", [0, 1, *(pytest.param(n, marks=pytest.mark.slow) for n in range(2, 200))]
)
def test_killed_at_any_moment_all_but_the_last_second_is_there(tmp_path, seed):
    path = tmp_path / "killed.mcap"
    rng = random.Random(seed)
    wanted = rng.randint(11, 400) * 10  # more than a second
    with start(_WRITE, path) as process:
        for line in process.stdout:
            if int(line) >= wanted:
                break
        process.send_signal(signal.SIGKILL)
    written = int(line)
    found, error = frames_in(path)
    assert error is None
    sequences = [frame.sequence for frame in found]
    assert sequences == list(range(len(sequences)))
    assert len(found) >= written - 101  # a second, and the frame that ends it
    mended = tmp_path / "mended.mcap"
    assert repair(path, mended).messages["/frames"] == len(found)
    assert len(frames_in(mended)[0]) == len(found)


_RECORD = """
import sys, threading
from pathlib import Path
from files.session.runs import frame_of, SKIN
from tomoskin.core import Capacity, Mark, MarkedFrame, Worker
from tomoskin.files.session import Recorder, SessionWriter
path = Path(sys.argv[1])
recorder = Recorder(path, lambda: SessionWriter(path, SKIN), None, print)
worker = Worker(recorder, Capacity(1 << 12, "oldest"), print)
worker.start()
worker.opening.result()
for number in range(20):
    worker.put(MarkedFrame(frame_of(number), Mark.NONE))
threading.Event().wait(1.0)
print("a second later", flush=True)
threading.Event().wait(60)
"""


def test_killed_while_nothing_comes_all_older_than_a_second_is_there(tmp_path):
    """Nothing new comes that could end the open chunk: the recorder's thread does."""
    path = tmp_path / "killed.mcap"
    with start(_RECORD, path) as process:
        assert process.stdout.readline() == "a second later\n"
        process.send_signal(signal.SIGKILL)
    assert [frame.sequence for frame in frames_in(path)[0]] == list(range(20))


@pytest.mark.parametrize("name", ["sequence", "touches", "host_time"])
def test_a_message_of_another_program_is_an_error_that_says_where(tmp_path, name):
    """Its chunk is whole and its JSON too, but it is no message of ours."""
    path = tmp_path / "all.mcap"
    message = {"host_time": 0.2, "sequence": 20, "touches": []}
    del message[name]
    with SessionWriter(path, SKIN) as session:
        session._log.put(TOUCHES, 0.2, encode_json(message))
    with SessionReader(path) as session, pytest.raises(DataError, match="/touches cannot be"):
        list(session.touches())
