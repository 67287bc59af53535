"""A simulated session says which frames its reference is made of."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tomoskin.live import Prepared, reconstruct, simulate
from tomoskin.session import Mark, Recording, SessionReader, read_session
from tomoskin.skin import Skin
from tomoskin.twin import Script

PRESS = """[[press]]
id = "a"
radius = "15 mm"
at = ["20 mm", "-30 mm"]
start = "200 ms"
force = "3 N"
hold = "300 ms"
"""
CUT = """[[fault]]
kind = "cut"
electrode = 2
start = "{start}"
end = "900 ms"
"""


def run(out: Path, lead_in: str, *happens: str) -> Path:
    """A second of a skin; a frame of it takes 56 ms."""
    head = f'format = 1\n[script]\nduration = "1 s"\nlead_in = "{lead_in}"\n'
    script = Script.from_toml(head + "".join(happens))
    simulate(script, Skin.load("textile-disc-8"), out, advance=lambda _, __: None)
    return out


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
    out = run(tmp_path / "a.mcap", lead_in, *happens)
    with SessionReader(out) as session:
        marks = [item.mark for item in session.frames()]
    assert marks[0] == Mark.REFERENCE
    assert not any(marks[1:])
    recording = read_session(out)
    assert recording.idle == expected
    assert recording.labels is not None
    assert np.isnan(recording.labels[:expected]).all()


def test_no_touch_is_seen_before_the_press(tmp_path: Path, prepared: Prepared) -> None:
    recording = read_session(run(tmp_path / "a.mcap", "1 s", PRESS))
    assert recording.labels is not None
    first = int(np.flatnonzero(np.isfinite(recording.labels[:, 0]))[0])
    touched = touched_frames(prepared, recording, recording.idle)
    assert touched
    assert min(touched) >= first
    assert min(touched_frames(prepared, recording, 1)) < first  # what a single frame would do
