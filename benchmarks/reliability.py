"""What a careful stranger breaks: damaged files and requests; sessions are a test's."""

from __future__ import annotations

import contextlib
import io
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from reliability_page import ask
from report import Report, progress, table
from tomoskin.cli import main
from tomoskin.core import DataError
from tomoskin.files.imports import read_recording
from tomoskin.learning import TOUCH
from tomoskin.model.skin import Skin
from tomoskin.sensing.signal import Recording
from tomoskin.twin import Script
from trials import Judge, Tally, attempt, mutated, remade

REQUESTS, FILES = 20_000, 2_000
SKIN = "textile-disc-8"
PRESSES = 20
SCRIPT = """format = 1

[script]
duration = "3 s"

[[press]]
id = "finger"
radius = "15 mm"
at = ["30 mm", "20 mm"]
start = "500 ms"
force = "4 N"
hold = "1 s"
"""
_ARRAYS = ("voltages", "drive", "measure", "time", "reference", "labels")


def run() -> Iterator[Report]:
    tallies = list(_tallies(FILES, REQUESTS))
    yield table(
        "reliability",
        (tally.row for tally in tallies),
        "refused: with a TomoskinError, one sentence; accepted: what was read is right, or "
        "nothing in the file can tell that it is not",
        *(f"{fault}: {text}" for tally in tallies for fault, text in tally.examples.items()),
    )


def _tallies(files: int, requests: int) -> Iterator[Tally]:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for kind, judge in judges(make_bases(folder), folder).items():
            progress(kind)
            yield attempt(kind, files, judge)
        progress("requests")
        (folder / "page").mkdir()
        yield ask(requests, folder / "page")


def command(*arguments: object) -> None:
    """A command as a person would give it, without its output; DataError where it fails."""
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()) as e:
        try:
            main([str(argument) for argument in arguments])
        except SystemExit as end:
            if end.code:
                raise DataError(e.getvalue(), where=str(arguments[0])) from None


def make_bases(folder: Path) -> dict[str, Path]:
    """An undamaged file of each kind."""
    names = {"session": "run.mcap", ".npz": "run.npz", ".mat": "run.mat", ".csv": "run.csv",
             "skin": "skin.toml", "script": "script.toml", "calibration": "touch.npz"}  # fmt: skip
    files = {kind: folder / name for kind, name in names.items()}
    files["script"].write_text(SCRIPT, encoding="utf-8")
    files["skin"].write_text(Skin.load(SKIN).to_toml(), encoding="utf-8")
    command("simulate", "--skin", SKIN, "--script", files["script"], "--out", files["session"])
    for kind in (".npz", ".mat", ".csv"):
        command("session", "export", files["session"], files[kind])
    presses = folder / "presses.npz"
    command("simulate", "--skin", SKIN, "--presses", PRESSES, "--processes", 1,
                "--out", presses)  # fmt: skip
    command("calibrate", "touch", presses, "--skin", SKIN, "--out", files["calibration"])
    return files


def judges(files: dict[str, Path], folder: Path) -> dict[str, Judge]:
    """How a damaged file of each kind is judged."""
    return {
        **{kind: _recording(files[kind], folder) for kind in (".npz", ".mat", ".csv")},
        "skin": _text(files["skin"], Skin.from_toml),
        "script": _text(files["script"], Script.from_toml),
        "calibration": _calibration(files["calibration"], folder),
    }


def _recording(base: Path, folder: Path) -> Judge:
    """Arrays that have a checksum are those that were written; the others fit together."""
    data, damaged, original = base.read_bytes(), folder / f"x{base.suffix}", read_recording(base)
    arrays = dict(np.load(base)) if base.suffix == ".npz" else None

    def judge(number: int) -> str:
        inside = arrays is not None and number % 2
        damaged.write_bytes(
            remade(arrays, number)
            if arrays is not None and inside
            else mutated(data, number, text=base.suffix == ".csv")
        )
        recording = read_recording(damaged)
        if arrays is not None and not inside:
            return _other(recording, original)
        shape = (len(recording.time), len(recording.drive))
        return "" if recording.voltages.shape == shape else f"voltages {recording.voltages.shape}"

    return judge


def _other(recording: Recording, original: Recording) -> str:
    for name in _ARRAYS:
        ours, theirs = getattr(recording, name), getattr(original, name)
        if (ours is None) != (theirs is None):
            return f"{name} is lost"
        if ours is not None and not np.array_equal(ours, theirs, equal_nan=True):
            return f"other {name}"
    return ""


def _text(base: Path, read: Callable[[str], object]) -> Judge:
    """A text has no checksum: whatever is read was meant."""
    data = base.read_bytes()

    def judge(number: int) -> str:
        read(mutated(data, number, text=True).decode("utf-8", "replace"))
        return ""

    return judge


def _calibration(base: Path, folder: Path) -> Judge:
    data, damaged = base.read_bytes(), folder / "x.npz"
    original = TOUCH.read(base).model
    frames = original.presses.dv[:5]
    expected = original.predict(frames)[0]

    arrays = dict(np.load(base))

    def judge(number: int) -> str:
        inside = number % 2
        damaged.write_bytes(remade(arrays, number) if inside else mutated(data, number))
        positions = TOUCH.read(damaged).model.predict(frames)[0]
        if not np.isfinite(positions).all():
            return "a position that is none"
        same = inside or np.allclose(positions, expected, atol=1e-9)
        return "" if same else "other positions"

    return judge
