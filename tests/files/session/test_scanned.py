"""Frames and touches of a session have one number and one time in every table."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path

import pytest

from files.session.runs import INFO, SCAN, SKIN, TOUCH, frame_of, put
from tomoskin.core import Mark
from tomoskin.files.exports import WRITERS, Export, export_touches, write_touches
from tomoskin.files.imports import read_recording
from tomoskin.files.session import SessionReader, SessionWriter
from tomoskin.files.session.scanned import no_report


@pytest.fixture
def session(tmp_path: Path) -> Path:
    """A run that was recorded from its 500th frame on, and whose board restarts.

    Frames are read two at a time; one is of another scan.
    """
    path = tmp_path / "x.mcap"
    with SessionWriter(path, SKIN) as writer:
        writer.device(5.0, INFO)
        for number in range(500, 510):
            frame = frame_of(number)
            put(writer, replace(frame, host_time=5.0 + 0.02 * ((number - 500) // 2)))
        put(writer, frame_of(510, n_samples=SCAN.n_samples + 1))
        for number in range(3):
            put(writer, replace(frame_of(number), host_time=6.0))
        writer.touches(5.02, 503, (TOUCH,))
        writer.touches(5.5, 511, (TOUCH,))
        writer.touches(6.0, 1, (TOUCH,))
    return path


def exported(session: Path, name: str) -> list[dict[str, str]]:
    path = session.with_name(f"{name}.csv")
    with SessionReader(session) as reader:
        export = Export(reader, 0.1, no_report)
        (export_touches if name == "touches" else WRITERS[".csv"])(export, path)
    with path.open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_a_frame_has_the_index_and_the_time_of_its_scan(session: Path) -> None:
    recording = read_recording(session)
    expected = [5.0 + 0.01 * n for n in range(10)] + [6.0, 6.01, 6.02]
    assert recording.time.tolist() == pytest.approx(expected, abs=1e-9)
    table = exported(session, "frames")
    assert [int(row["frame"]) for row in table] == list(range(13))
    assert [float(row["time_s"]) for row in table] == recording.time.tolist()


def test_recorded_touches_stand_at_the_same_frames_and_times(session: Path) -> None:
    """As ``image --touches`` writes them; a touch whose frame is not there has no number."""
    time, own = read_recording(session).time, session.with_name("own.csv")
    write_touches(own, [(frame, float(time[frame]), (TOUCH,)) for frame in (3, 11)])
    with own.open(encoding="utf-8") as file:
        first, last = csv.DictReader(file)
    rows = exported(session, "touches")
    elapsed = [float(row.pop("elapsed_s")) for row in rows]
    assert rows == [first, first | {"frame": "", "time_s": "5.500000"}, last]
    assert elapsed == pytest.approx([0.03, 0.5, 1.01], abs=1e-6), "since the first frame"


def test_a_first_frame_that_was_read_late_is_the_beginning_all_the_same(tmp_path: Path) -> None:
    """The recording begins with earlier frames; the host reads its own first one 0.3 s late."""
    path = tmp_path / "late.mcap"
    with SessionWriter(path, SKIN) as writer:
        writer.device(5.0, INFO)
        for number, late in enumerate((0.0, 0.0, 0.3, 0.29)):
            frame = replace(frame_of(number), host_time=5.0 + 0.01 * number + late)
            put(writer, frame, Mark.EARLIER if number < 2 else Mark.NONE)
            if number >= 2:
                writer.touches(frame.host_time, number, (TOUCH,))
    rows = exported(path, "touches")
    assert [float(row["elapsed_s"]) for row in rows] == pytest.approx([0.0, 0.01], abs=1e-6)
