"""Recording beside a run: what comes is written, and what goes wrong with the disk is said."""

from __future__ import annotations

import errno
import io
import resource
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest

from files.session.runs import INFO, SKIN, TOUCH, frame_of, same_frame
from tomoskin.board.wire import encode
from tomoskin.core import Capacity, DataError, Event, Image, Mark, MarkedFrame, Worker
from tomoskin.files.session import (
    BoardInfo,
    RawRead,
    Recorder,
    RunSettings,
    SessionReader,
    SessionWriter,
    Truth,
    message_counts,
)
from tomoskin.files.session.recorder import IMAGE_PERIOD
from tomoskin.pipeline import FrameResult

PATIENCE = 300


class Failing(io.FileIO):
    """A file on a disk that has room for so many bytes, then an error."""

    room = 100_000
    number = errno.ENOSPC

    def write(self, data):
        left = self.room - self.tell()
        if left <= 0:
            raise OSError(self.number, "No space left on device")
        return super().write(bytes(data)[:left])


class FailingPath(type(Path())):
    """A path whose file fails."""

    def open(self, mode="r", buffering=-1, **_):
        return Failing(str(self), mode) if "x" in mode else super().open(mode, buffering)


class Slow(io.FileIO):
    """A file on a disk that answers when it is told to."""

    go = threading.Event()

    def write(self, data):
        assert self.go.wait(PATIENCE)
        return super().write(data)


class Said:
    """Events of a recorder."""

    def __init__(self):
        self.events = []
        self._news = threading.Condition()

    def __call__(self, kind, text):
        with self._news:
            self.events.append((kind, text))
            self._news.notify_all()

    def wait_until(self, holds):
        with self._news:
            assert self._news.wait_for(holds, PATIENCE)

    def texts(self, kind):
        return [text for k, text in self.events if k == kind]

    def wait_for(self, kind):
        self.wait_until(lambda: self.texts(kind))
        return self.texts(kind)[0]


@pytest.fixture
def said():
    return Said()


@pytest.fixture
def start(said):
    """Start a recorder and its worker; ended after the test."""
    workers = []

    def start(path, pixels=None, *, make=None, most=1 << 30):
        make = make or (lambda: SessionWriter(path, SKIN))
        worker = Worker(Recorder(path, make, pixels, said), Capacity(most, "oldest"), said)
        worker.start()
        worker.opening.result(PATIENCE)
        workers.append(worker)
        return worker

    yield start
    for worker in workers:
        end(worker)


def end(worker):
    worker.end()
    worker.ending.result(PATIENCE)


def record(worker, count, start=0):
    for number in range(start, start + count):
        frame = frame_of(number)
        worker.put(RawRead(frame.host_time, encode(frame)))
        worker.put(MarkedFrame(frame, Mark.NONE))


def result_of(number, image, *touches):
    """A result of the frame ``number``, a hundred a second."""
    none = np.zeros(1)
    return FrameResult(number, number / 100, True, True, image, none, none, touches, 0)


def frames_in(path):
    with SessionReader(path) as session:
        return [item.frame for item in session.frames()]


def test_everything_is_written(tmp_path, said, start):
    path = tmp_path / "x.mcap"
    worker = start(path, SKIN.mesh().pixels(16))
    worker.put(BoardInfo(0.0, INFO))
    worker.put(Truth(0.0, ()))
    worker.put(Event(0.0, "lost", "two"))
    worker.put(Event(0.0, "note", "mark"))
    worker.put(RunSettings(0.0, {"source": "test"}))
    record(worker, 3000)
    end(worker)
    assert said.events == [("recorded", f"recorded to {path}")]
    with SessionReader(path) as session:
        frames = [item.frame for item in session.frames()]
        assert all(same_frame(f, frame_of(n)) for n, f in enumerate(frames))
        assert len(frames) == 3000
        assert session.clock()["frames"] >= 2000
        assert session.clock()["tick_rate"] == pytest.approx(16e6, rel=1e-3)
        counts = message_counts(session)
    assert counts["/events"] == counts["/notes"] == counts["/device"] == counts["/truth"] == 1


def test_touches_until_there_are_none_and_images_now_and_then(tmp_path, start):
    path = tmp_path / "x.mcap"
    mesh = SKIN.mesh()
    image = Image(np.zeros(len(mesh.cells)), "S", mesh.identity)
    worker = start(path, mesh.pixels(16))
    for number in range(100):
        worker.put(result_of(number, image, *((TOUCH,) if 20 <= number < 30 else ())))
    end(worker)
    with SessionReader(path) as session:
        rows = [(item.sequence, len(item.touches)) for item in session.touches()]
        counts = message_counts(session)
    assert rows == [*((n, 1) for n in range(20, 30)), (30, 0)]
    assert counts["/image"] == counts["/scene"] == round(1 / IMAGE_PERIOD)


def test_a_curved_sheet_has_no_images(tmp_path, start):
    worker = start(tmp_path / "x.mcap")
    worker.put(result_of(0, Image(np.zeros(3), "S", "")))
    end(worker)
    with SessionReader(tmp_path / "x.mcap") as session:
        assert message_counts(session)["/image"] == 0


def test_a_full_disk_ends_the_recording_and_leaves_it_readable(tmp_path, monkeypatch, said, start):
    monkeypatch.setattr("tomoskin.files.session.session_writer.Path", FailingPath)
    path = tmp_path / "x.mcap"
    worker = start(path)
    record(worker, 500)
    text = said.wait_for("recording-stopped")
    assert "No space left" in text
    assert str(path) in text
    worker.ending.result(PATIENCE)
    record(worker, 10, start=500)  # goes nowhere, and hurts nobody
    assert "recorded" not in dict(said.events)
    frames = frames_in(path)
    assert len(frames) > 30
    assert all(same_frame(frame, frame_of(n)) for n, frame in enumerate(frames))
    with SessionReader(path) as session:
        list(session.frames())
        assert path.stat().st_size <= Failing.room
        assert "cut" not in session.torn  # it ends with a whole record


def test_a_file_that_is_taken_away_ends_the_recording(tmp_path, said, start):
    path = tmp_path / "x.mcap"
    record(start(path), 50)
    path.unlink()
    assert "was removed" in said.wait_for("recording-stopped")


def test_a_slow_disk_loses_messages_but_delays_nobody(tmp_path, said, start, monkeypatch):
    path = tmp_path / "x.mcap"
    Slow.go.set()
    monkeypatch.setattr(Path, "open", lambda self, *_, **__: Slow(str(self), "x"))
    session = SessionWriter(path, SKIN)
    monkeypatch.undo()
    worker = start(path, make=lambda: session, most=100)
    Slow.go.clear()
    record(worker, 2000)  # returns although nothing can be written
    assert "the disk is too slow" in said.wait_for("recording-behind")
    Slow.go.set()

    def counted():
        """Messages that all gaps tell of: there may be one before the disk stands still."""
        gaps = said.texts("recording-gap")
        assert all(gap.endswith(" messages were left out") for gap in gaps)
        return sum(int(gap.split()[-5]) for gap in gaps)

    said.wait_until(lambda: counted() == worker.left_out)
    record(worker, 20, start=2000)
    end(worker)
    assert counted() == worker.left_out > 0
    frames = frames_in(path)
    assert [f.sequence for f in frames[-20:]] == list(range(2000, 2020))
    assert len(frames) < 2020


def test_a_fault_of_our_own_ends_the_recording_and_is_said(tmp_path, said, start, caplog):
    path = tmp_path / "x.mcap"
    worker = start(path)
    record(worker, 50)
    worker.put(Truth(0.0, (object(),)))
    assert "internal error" in said.wait_for("recording-stopped")
    end(worker)
    assert "the recording thread ended" in caplog.text
    assert len(frames_in(path)) == 50


def test_a_file_that_cannot_be_made_is_an_error_for_who_asked(tmp_path, said, start):
    with pytest.raises(DataError, match="cannot be"):
        start(tmp_path / "none" / "x.mcap")
    assert said.events == []


@pytest.mark.parametrize("name", ["none/x.mcap", "file/x.mcap"])
def test_a_place_that_cannot_be_written_is_said_at_once(tmp_path, name):
    (tmp_path / "file").write_text("")
    with pytest.raises(DataError, match="cannot be"):
        SessionWriter(tmp_path / name, SKIN)


def test_a_real_limit_on_the_files_size(tmp_path):
    """The kernel refuses to write on: the command says so, and the file is readable."""
    path = tmp_path / "x.mcap"
    command = "from tomoskin.cli import main; main()"
    limit = 400_000  # a few chunks: what is lost is the one that does not fit
    done = subprocess.run(
        [sys.executable, "-c", command, "record", str(path), "--source", "twin:fast"],
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)),
    )
    assert done.returncode == 1
    assert "the recording has ended" in done.stderr
    assert "File too large" in done.stderr
    assert len(frames_in(path)) > 10
    assert path.stat().st_size <= limit
