"""A session file: what is written is read, by us and by the format's own library."""

from __future__ import annotations

import base64
import json
import struct
from dataclasses import replace

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.stream_reader import StreamReader

from files.session.runs import (
    INFO,
    PRESS,
    SCAN,
    SKIN,
    TOUCH,
    frame_of,
    put,
    same_frame,
    write_all,
    write_frames as write,
)
from tomoskin.board.wire import encode
from tomoskin.core import DataError, Mark
from tomoskin.files.imports import read_recording
from tomoskin.files.session import SessionReader, SessionWriter
from tomoskin.sensing.signal import Readout


@pytest.fixture
def whole(tmp_path):
    return write_all(tmp_path / "whole.mcap")


def test_everything_comes_back(whole):
    with SessionReader(whole) as session:
        found = list(session.frames())
        assert [same_frame(item.frame, frame_of(n)) for n, item in enumerate(found)] == [True] * 30
        assert [n for n, item in enumerate(found) if item.mark is Mark.REFERENCE] == [5]
        raw = list(session.raw())
        assert raw == [(frame_of(n).host_time, encode(frame_of(n))) for n in range(30)]
        assert [e.text for e in session.events()] == ["board 01"]
        assert [(e.host_time, e.text) for e in session.notes()] == [(0.1, "pressed")]
        assert [item.presses for item in session.truth()] == [(), (PRESS,)]
        assert session.device()["firmware"] == "1.2.3"
        assert session.device()["unique_id"] == INFO.unique_id.hex()
        assert session.clock()["tick_rate"] == 16e6
        assert session.settings()["source"] == "twin"
        assert session.attachments()["calibration.json"] == b"{}"
        assert session.skin.identity == SKIN.identity
        assert session.epoch == 1e9
        assert not session.torn


def test_touches_come_back_to_the_bit(whole):
    with SessionReader(whole) as session:
        [item] = session.touches()
    [got], names = item.touches, ("x", "y", "sd_x", "area", "peak")
    assert (item.host_time, item.sequence) == (frame_of(20).host_time, 20)
    assert (got.id, got.kind, got.since) == (TOUCH.id, TOUCH.kind, TOUCH.since)
    assert all(getattr(got.detection, n) == getattr(TOUCH.detection, n) for n in names)
    assert np.isnan(got.detection.sd_y)


def test_the_recording_has_the_voltages_of_the_readout_and_labels_from_truth(whole):
    got = read_recording(whole)
    readout = Readout.of(SCAN, SKIN.readout)
    expected = readout(frame_of(7))
    assert np.array_equal(got.voltages[7][~expected.excluded], expected.values[~expected.excluded])
    assert np.array_equal(np.isnan(got.voltages[7]), expected.excluded)
    assert np.array_equal(got.drive, SKIN.pattern().drive)
    assert np.array_equal(got.measure, SKIN.pattern().measure)
    assert got.time[7] == pytest.approx(frame_of(7).host_time, abs=1e-6)  # by its ticks
    assert np.isnan(got.labels[:10]).all()
    assert np.array_equal(got.labels[10:], np.tile((PRESS["x"], PRESS["y"]), (20, 1)))


def test_a_session_without_truth_has_no_labels(tmp_path):
    assert read_recording(write(tmp_path / "x.mcap", 3)).labels is None


def test_frames_of_another_scan_are_left_out_of_the_recording(tmp_path):
    with SessionWriter(tmp_path / "x.mcap", SKIN) as session:
        put(session, frame_of(0))
        put(session, frame_of(1, n_samples=5))
    assert len(read_recording(tmp_path / "x.mcap")) == 1


def test_a_clock_that_does_not_go_on_is_noted(tmp_path):
    path = tmp_path / "run.mcap"
    with SessionWriter(path, SKIN) as session:
        session.device(0.0, INFO)
        for number in range(6):
            ticks = frame_of(min(number, 3)).ticks
            put(session, replace(frame_of(number), ticks=ticks))
    (note,) = read_recording(path).notes
    assert note.startswith("the board's clock does not go on in 2 frames: 4, 5; each counts")


def test_the_same_calls_give_the_same_bytes(tmp_path):
    one, two = write_all(tmp_path / "1.mcap"), write_all(tmp_path / "2.mcap")
    assert one.read_bytes() == two.read_bytes()


def test_an_existing_file_is_never_written_over(tmp_path):
    path = tmp_path / "x.mcap"
    path.write_text("mine")
    with pytest.raises(DataError, match="exists already"):
        SessionWriter(path, SKIN)
    assert path.read_text() == "mine"


@pytest.mark.parametrize("host_time", [-1.0, float("nan"), float("inf")])
def test_an_impossible_time_is_refused(tmp_path, host_time):
    with SessionWriter(tmp_path / "x.mcap", SKIN) as session:
        with pytest.raises(DataError, match="expected a host time"):
            session.note(host_time, "when?")
        session.note(0.0, "now")
    with SessionReader(tmp_path / "x.mcap") as session:
        assert [e.text for e in session.notes()] == ["now"]


@pytest.mark.parametrize("since", [0.0, 0.005, 1.0, 17.23, 29.99, 31.0])
def test_frames_from_a_time_on(tmp_path, since):
    path = write(tmp_path / "x.mcap", 3000)
    with SessionReader(path) as session:
        got = [item.frame.sequence for item in session.frames(since)]
    assert got == [n for n in range(3000) if frame_of(n).host_time >= since]


def test_the_formats_own_library_reads_it(whole):
    """With every CRC checked, by the index and in file order."""
    with whole.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        indexed = [(c.topic, m.log_time, m.data) for _, c, m in reader.iter_messages()]
        assert {a.name for a in reader.iter_attachments()} >= {"skin.toml", "calibration.json"}
        assert {m.name for m in reader.iter_metadata()} == {"tomoskin"}
    assert summary.statistics.message_count == len(indexed) == 70
    assert summary.statistics.message_start_time == 10**18
    with whole.open("rb") as file:
        kinds = [type(r).__name__ for r in StreamReader(file, validate_crcs=True).records]
    assert kinds.count("Message") == 70
    assert kinds[-1] == "Footer"


def test_standard_messages_are_what_foxglove_reads(whole):
    with whole.open("rb") as file:
        found = {
            c.topic: (s.name, s.encoding, json.loads(m.data))
            for s, c, m in make_reader(file).iter_messages()
            if c.message_encoding == "json"
        }
    name, encoding, grid = found["/image"]
    assert (name, encoding) == ("foxglove.Grid", "jsonschema")
    pixels = np.frombuffer(base64.b64decode(grid["data"]), "<f4")
    expected = SKIN.mesh().pixels(48).spread(np.linspace(-1, 1, len(SKIN.mesh().cells)))
    rows = pixels.reshape(-1, grid["column_count"])
    assert np.array_equal(rows, expected[::-1].astype("<f4"), equal_nan=True)
    corner, size = grid["pose"]["position"], grid["cell_size"]["x"]
    assert corner["x"] == pytest.approx(SKIN.mesh().points[:, 0].min(), abs=size)
    assert corner["y"] == pytest.approx(SKIN.mesh().points[:, 1].min(), abs=size)
    assert found["/events"][0] == "foxglove.Log"
    name, _, scene = found["/scene"]
    assert name == "foxglove.SceneUpdate"
    assert scene["entities"][0]["texts"][0]["text"] == str(TOUCH.id)


def test_frames_are_cdr_as_their_schema_says(whole):
    """Decoded here by the rules of CDR alone, from the fields of the schema in the file."""
    with whole.open("rb") as file:
        schema, _, message = next(iter(make_reader(file).iter_messages("/frames")))
    assert (schema.name, schema.encoding) == ("tomoskin_msgs/msg/Frame", "ros2msg")
    kinds = {"float64": "d", "uint64": "Q", "uint32": "I", "uint16": "H", "uint8": "B"}
    body, place, values = message.data[4:], 0, {}
    for line in schema.data.decode().splitlines():
        kind, _, rest = line.partition(" ")
        if kind.startswith("#"):
            continue
        item, many, _ = kind.partition("[]")
        code = kinds[item]
        count = 1
        if many:
            place += -place % 4
            [count] = struct.unpack_from("<I", body, place)
            place += 4
        place += -place % struct.calcsize(code)
        values[rest.split()[0]] = struct.unpack_from(f"<{count}{code}", body, place)
        place += count * struct.calcsize(code)
    assert place == len(body)
    first = frame_of(0)
    assert values["host_time"] == (first.host_time,)
    assert values["configuration"] == (first.configuration,)
    assert values["samples"] == tuple(first.samples.tolist())


def test_frames_of_one_read_are_as_far_apart_as_they_were_scanned(tmp_path):
    """Two by two they share a host time; where the ticks go back, they count from the next one."""
    frames = [replace(frame_of(n), host_time=0.1 * (n // 2)) for n in range(6)]
    times = []
    for name, last in (("on", frames[5]), ("back", replace(frames[5], ticks=3))):
        path = tmp_path / f"{name}.mcap"
        with SessionWriter(path, SKIN, epoch=1e9) as session:
            session.device(0.0, INFO)
            for frame in (*frames[:5], last):
                put(session, frame)
        times.append(read_recording(path).time)
    assert np.diff(times[0]) == pytest.approx(np.diff([f.ticks for f in frames]) / 16e6)
    assert times[1].tolist() == [*times[0][:5], frames[5].host_time]
