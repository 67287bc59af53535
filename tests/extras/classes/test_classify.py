"""``tomoskin calibrate class`` and ``tomoskin classify``."""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tomoskin.core import FloatArray
from tomoskin.model.pattern import Pattern

PATTERN = Pattern.adjacent(8)
Run = Callable[..., tuple[int, str, str]]


def frames(kind: FloatArray, seed: int, size: float = 1.0) -> FloatArray:
    fixed = np.random.default_rng(9).normal(size=(kind.shape[1], PATTERN.n_meas))
    noise = np.random.default_rng(seed).normal(size=(len(kind), PATTERN.n_meas))
    return np.asarray(size * kind @ fixed + 0.2 * noise)


def write(path: Path, dv: FloatArray, **labels: object) -> Path:
    np.savez(path, dv=dv, drive=PATTERN.drive, measure=PATTERN.measure, **labels)  # type: ignore[arg-type]
    return path


@pytest.fixture
def flagged(tmp_path: Path) -> Path:
    flags = np.random.default_rng(0).integers(0, 2, (80, 3)).astype(float)
    return write(
        tmp_path / "flags.npz", frames(flags, 0), flags=flags, flag_names=["bend", "left", "right"]
    )


def test_ranges_of_frames_teach_classes(tomoskin: Run, tmp_path: Path) -> None:
    kind = np.repeat(np.eye(3), 20, axis=0)
    path = write(tmp_path / "frames.npz", frames(kind, 0))
    c, table = tmp_path / "c.npz", tmp_path / "x.csv"
    given = ("--class", "idle=0:15", "--class", "bend=20:35", "--class", "touch=40:55")
    code, out, err = tomoskin("calibrate", "class", path, *given, "--out", c)
    assert (code, err) == (0, "")
    assert out.startswith("3 classes: bend, idle, touch\n45 of 60 frames labelled")
    strange = 5 * np.random.default_rng(7).normal(size=(1, PATTERN.n_meas))
    asked = write(tmp_path / "asked.npz", np.vstack([frames(kind, 1), strange]))
    code, out, err = tomoskin("classify", asked, "--calibration", c, "--out", table, "--ask", 2)
    assert (code, err) == (0, "")
    assert re.search(r"frames    0 to +\d+  idle  \d+ % or more\nframes +\d+ to +\d+  ", out)
    assert "label frames 15, 45" in out
    with table.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    expected = [("idle", "bend", "touch")[k // 20] for k in range(60)]
    assert np.mean([r["class"] == e for r, e in zip(rows, expected, strict=False)]) > 0.95
    assert rows[60]["unknown"] == "1"
    assert float(rows[0]["idle"]) == pytest.approx(float(rows[0]["probability"]))


def test_flags_and_another_session(tomoskin: Run, tmp_path: Path, flagged: Path) -> None:
    c, new = tmp_path / "c.npz", tmp_path / "new.npz"
    code, out, err = tomoskin("calibrate", "class", flagged, "--out", c)
    assert (code, err) == (0, "")
    assert out.startswith("3 flags: bend, left, right\n80 of 80 frames labelled")
    truth = np.random.default_rng(1).integers(0, 2, (80, 3)).astype(float)
    today = write(tmp_path / "today.npz", frames(truth, 2, size=0.5))
    code, out, err = tomoskin("calibrate", "class", today, "--onto", c, "--out", new, "--json")
    assert (code, err) == (0, "")
    found = json.loads(out)
    assert (found["labelled"], found["sessions"], found["names"][1]) == (0, 2, "left")
    right = []
    for calibration in (c, new):
        code, out, _ = tomoskin("classify", today, "--calibration", calibration, "--json")
        assert code == 0
        told = np.array([np.round(row["each"]) for row in json.loads(out)["frames"]])
        right.append(float((told == truth).all(axis=1).mean()))
    assert right[1] > 0.95 >= right[0]


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ((), "holds no classes"),
        (("--class", "idle=0:10"), 'two classes, got only "idle"'),
        (("--class", "idle=0:10", "--class", "touch=5:20"), "already have the label idle"),
        (("--class", "idle=0:99", "--class", "touch=5:20"), "within 0:30"),
    ],
)
def test_what_says_too_little_is_refused(
    tomoskin: Run, tmp_path: Path, given: tuple[str, ...], words: str
) -> None:
    path = write(tmp_path / "frames.npz", frames(np.ones((30, 1)), 0))
    c = tmp_path / "c.npz"
    code, _, err = tomoskin("calibrate", "class", path, *given, "--out", c)
    assert code == 1
    assert words in err
    assert not c.exists()
    assert tomoskin("calibrate", "class", path, "--class", "idle", "--out", c)[0] == 2


def test_another_skin_or_another_file_is_refused(
    tomoskin: Run, tmp_path: Path, flagged: Path
) -> None:
    c = tmp_path / "c.npz"
    skin = ("--skin", "textile-disc-8")
    assert tomoskin("calibrate", "class", flagged, *skin, "--out", c)[0] == 0
    assert tomoskin("classify", flagged, "--calibration", c, *skin)[0] == 0
    code, _, err = tomoskin("classify", flagged, "--calibration", c, "--skin", "textile-disc-16")
    assert code == 1
    assert 'learnt on "textile-disc-8" and is used on "textile-disc-16"' in err
    code, _, err = tomoskin("classify", flagged, "--calibration", flagged)
    assert code == 1
    assert "not a calibration of classes" in err
    code, _, err = tomoskin("locate", flagged, "--calibration", c)
    assert code == 1
    assert "not a calibration of touch" in err
    with np.load(c) as kept:
        arrays = dict(kept)
    for change in ({"dv": arrays["dv"][:, :9]}, {"version": 7}, {"session": arrays["session"] - 1}):
        np.savez(c, **(arrays | change))
        code, _, err = tomoskin("classify", flagged, "--calibration", c)
        assert code == 1
        assert "internal" not in err
