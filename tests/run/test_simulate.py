"""A simulated session says which frames its reference is made of."""

from __future__ import annotations

import signal
from pathlib import Path

import numpy as np
import pytest

from run.scripted import FRAME, PRESS, fault, run
from tomoskin.core import DataError, Mark
from tomoskin.files.session import SessionReader, read_session
from tomoskin.pipeline import Prepared, reconstruct
from tomoskin.sensing.signal import Recording

CUT = fault("cut", "{start}", "900 ms", electrode=2)


def touched_frames(prepared: Prepared, recording: Recording, n_idle: int) -> list[int]:
    """Frames with a touch, against the mean of the first ``n_idle``."""
    found = reconstruct(prepared, recording, recording.voltages[:n_idle])
    return [f for f, seen in zip(found.frames.tolist(), found.touches, strict=True) if seen]


@pytest.mark.parametrize(
    ("lead_in", "happens", "expected"),
    [
        ("300 ms", (PRESS,), 8),
        ("2 s", (PRESS,), 20),
        ("300 ms", (PRESS, CUT.format(start="100 ms")), 7),
        ("300 ms", (), 20),
        ("0 s", (PRESS, CUT.format(start="0 s")), 1),
    ],
)
def test_the_reference_ends_before_anything_presses_or_breaks(
    tmp_path: Path, lead_in: str, happens: tuple[str, ...], expected: int
) -> None:
    out = tmp_path / "a.mcap"
    run(out, lead_in, *happens)
    with SessionReader(out) as session:
        marks = [item.mark for item in session.frames()]
    assert marks[0] == Mark.REFERENCE
    assert not any(marks[1:])
    recording = read_session(out)
    assert recording.idle == expected
    assert recording.labels is not None
    assert np.isnan(recording.labels[:expected]).all()


def test_no_touch_is_seen_before_the_press(tmp_path: Path, prepared: Prepared) -> None:
    run(tmp_path / "a.mcap", "1 s", PRESS)
    recording = read_session(tmp_path / "a.mcap")
    assert recording.labels is not None
    first = int(np.flatnonzero(np.isfinite(recording.labels[:, 0]))[0])
    touched = touched_frames(prepared, recording, recording.idle)
    assert touched
    assert min(touched) >= first


def test_the_truth_of_a_sliding_press_is_that_of_the_middle_of_the_scan(tmp_path: Path) -> None:
    path = 'path = [["500 ms", "-30 mm", "-30 mm"]]\n'
    run(tmp_path / "a.mcap", "1 s", PRESS.replace('"20 mm", "-30 mm"', '"40 mm", "-30 mm"') + path)
    with SessionReader(tmp_path / "a.mcap") as session:
        truth = {item.host_time - 1.0: item.presses[0] for item in session.truth() if item.presses}
    speed = -0.07 / 0.5
    for time, press in truth.items():
        gone = min(max(time - 0.2, 0.0), 0.5)
        assert press["x"] == pytest.approx(0.04 + speed * gone, abs=2e-3 * abs(speed))
    assert len(truth) > 8


def test_ctrl_c_leaves_a_file_that_says_it_is_a_part(tmp_path: Path) -> None:
    def interrupt(gone: float, whole: float) -> None:
        assert whole == 2.0
        if gone > 1.3:
            signal.raise_signal(signal.SIGINT)

    out = tmp_path / "a.mcap"
    with pytest.raises(KeyboardInterrupt):
        run(out, "1 s", PRESS, advance=interrupt)
    with SessionReader(out) as session:
        *_, last = session.notes()
        frames = list(session.frames())
    assert last.text.startswith("stopped after 1.4 of 2 s: interrupted")
    assert len(frames) == pytest.approx(1.35 / FRAME, abs=1.5)
    whole = tmp_path / "b.mcap"
    run(whole, "1 s", PRESS)
    recording = read_session(whole).voltages
    assert (read_session(out).voltages == recording[: len(frames)]).all()


def test_what_else_ends_it_is_said_too(tmp_path: Path) -> None:
    def full(gone: float, _: float) -> None:
        if gone > 1.3:
            raise DataError("the disk is full", where="a.mcap")

    with pytest.raises(DataError):
        run(tmp_path / "a.mcap", "1 s", advance=full)
    with SessionReader(tmp_path / "a.mcap") as session:
        assert [note.text for note in session.notes()] == [
            "stopped after 1.4 of 2 s: a.mcap: the disk is full"
        ]
