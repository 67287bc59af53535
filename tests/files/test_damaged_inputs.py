"""Recordings, skins, scripts and calibrations that are damaged: refused in a sentence, or read.

``DAMAGED`` says how many of each kind are tried; `make test-all` tries a hundred.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from damage import mutated, remade
from tomoskin.cli import main
from tomoskin.core import TomoskinError
from tomoskin.files.imports import read_recording
from tomoskin.learning import TOUCH
from tomoskin.model.skin import Skin
from tomoskin.sensing.signal import Recording
from tomoskin.twin import Script

COUNT = int(os.environ.get("DAMAGED", "100"))
SKIN = "textile-disc-8"
SCRIPT = """format = 1

[script]
duration = "2 s"

[[press]]
id = "finger"
radius = "15 mm"
at = ["30 mm", "20 mm"]
start = "500 ms"
force = "4 N"
hold = "1 s"
"""
ARRAYS = ("voltages", "drive", "measure", "time", "reference", "labels")

pytestmark = pytest.mark.slow


def command(*arguments: object) -> None:
    """As a person would give it."""
    code: object = 0
    try:
        main([str(argument) for argument in arguments])
    except SystemExit as end:
        code = end.code
    assert not code


def judged(read: Callable[[int], None]) -> None:
    """Try every number: what raises something else than our own errors fails the test."""
    refused = 0
    for number in range(COUNT):
        try:
            read(number)
        except TomoskinError:
            refused += 1
    assert refused > 0


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("whole")
    (folder / "script.toml").write_text(SCRIPT, encoding="utf-8")
    file = folder / "run.mcap"
    command("simulate", "--skin", SKIN, "--script", folder / "script.toml", "--out", file)
    return file


def assert_same(recording: Recording, original: Recording) -> None:
    for name in ARRAYS:
        ours, theirs = getattr(recording, name), getattr(original, name)
        assert (ours is None) == (theirs is None), name
        assert ours is None or np.array_equal(ours, theirs, equal_nan=True), name


@pytest.mark.parametrize("ending", [".npz", ".csv"])
def test_a_damaged_recording_is_refused_or_what_was_written(
    session: Path, tmp_path: Path, ending: str
) -> None:
    """Archives have checksums; what is wrong inside an undamaged one fits together at least."""
    base, damaged = tmp_path / f"base{ending}", tmp_path / f"x{ending}"
    command("session", "export", session, base)
    data, original = base.read_bytes(), read_recording(base)
    arrays = dict(np.load(base)) if ending == ".npz" else None

    def read(number: int) -> None:
        inside = arrays if arrays is not None and number % 2 else None
        text = ending == ".csv"
        damaged.write_bytes(
            mutated(data, number, text=text) if inside is None else remade(inside, number)
        )
        recording = read_recording(damaged)
        assert recording.voltages.shape == (len(recording.time), len(recording.drive))
        if arrays is not None and inside is None:
            assert_same(recording, original)

    judged(read)


@pytest.mark.parametrize(
    ("text", "read"),
    [(Skin.load(SKIN).to_toml(), Skin.from_toml), (SCRIPT, Script.from_toml)],
    ids=["skin", "script"],
)
def test_a_damaged_text_is_refused_or_meant(text: str, read: Callable[[str], object]) -> None:
    data = text.encode()
    judged(lambda number: bool(read(mutated(data, number, text=True).decode("utf-8", "replace"))))


def test_a_damaged_calibration_is_refused_or_gives_the_same_positions(tmp_path: Path) -> None:
    presses, base, damaged = (tmp_path / name for name in ("presses.npz", "touch.npz", "x.npz"))
    command("simulate", "--skin", SKIN, "--presses", 20, "--processes", 1, "--out", presses)
    command("calibrate", "touch", presses, "--skin", SKIN, "--out", base)
    data, arrays, original = base.read_bytes(), dict(np.load(base)), TOUCH.read(base).model
    frames = original.presses.dv[:5]
    expected = original.predict(frames)[0]

    def read(number: int) -> None:
        inside = bool(number % 2)
        damaged.write_bytes(remade(arrays, number) if inside else mutated(data, number))
        positions = TOUCH.read(damaged).model.predict(frames)[0]
        assert np.isfinite(positions).all()
        assert inside or np.allclose(positions, expected, atol=1e-9)

    judged(read)
