"""One flow: every way from a session to its touches gives the same, to the bit."""

from __future__ import annotations

import csv
import math
import os
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest

from run.scripted import fault
from run.test_replay import Recorded, late
from run.test_runner import Watch
from tomoskin.core import Touch
from tomoskin.files.session import (
    ReplayTransport,
    Session,
    SessionReader,
    reconstruct_session,
    session_info,
)
from tomoskin.files.session.scanned import scanned_touches
from tomoskin.learning import TOUCH, Locator
from tomoskin.model.skin import Skin
from tomoskin.pipeline import Prepared, prepare
from tomoskin.pipeline.pipeline import REFERENCE_FRAMES
from tomoskin.run import Runner, commands, simulate
from tomoskin.sensing.segment import Region
from tomoskin.twin import Script

HEAD = 'format = 1\n[script]\nduration = "1800 ms"\nlead_in = "1400 ms"\n'
PRESSES = """[[press]]
id = "{id}"
radius = "12 mm"
at = ["{x} mm", "{y} mm"]
start = "{start} ms"
force = "5 N"
hold = "700 ms"
{more}
"""
A = PRESSES.format(id="a", x=30, y=20, start=100, more="")
B = PRESSES.format(id="b", x=-30, y=-20, start=200, more="")
SLIDE = PRESSES.format(id="a", x=-30, y=10, start=100, more='path = [["700 ms", "30 mm", "10 mm"]]')
LOST = fault("cut", "600 ms", "1800 ms", electrode=2)
SCRIPTS = {"two presses": A + B, "a slide": SLIDE, "an electrode lost": A + LOST}
WAYS = (*SCRIPTS, "a late recording")
PLAIN = ("two presses", "a slide")
"""Those of which a table of voltages tells all: it holds neither readings at a rail nor the run
before it."""


@pytest.fixture(scope="module")
def fitted() -> Prepared:
    return prepare(Skin.load("textile-disc-8"))


@pytest.fixture(scope="module", params=WAYS)
def session(request: pytest.FixtureRequest, tmp_path_factory, fitted: Prepared) -> Path:
    path = Path(tmp_path_factory.mktemp("flow") / f"{request.param}.mcap")
    if request.param in SCRIPTS:
        simulate(Script.from_toml(HEAD + SCRIPTS[request.param]), fitted.skin, path)
    else:
        with Recorded(fitted, path.with_name("whole.mcap")) as live:
            live.idle(REFERENCE_FRAMES)
            late(live, path)
    return path


@pytest.fixture(scope="module")
def calibration(fitted: Prepared, tmp_path_factory) -> Path:
    """A file of 40 presses, each with what the linear model says of it."""
    places = 0.8 * Region.of(fitted.skin).metres(Region.of(fitted.skin).lattice(40))
    cells = fitted.mesh.centroids[:, None, :2] - places
    change = -0.3 * np.exp(-(cells**2).sum(axis=2) / 0.014**2) * fitted.skin.conductivity
    dv = (fitted.problem.jacobian @ change).T
    locator = Locator.fit(dv, places, skin=fitted.skin)
    path = Path(tmp_path_factory.mktemp("calibration") / "c.npz")
    TOUCH.of(locator, fitted.pattern, fitted.skin).write(path)
    return path


def again(path: Path, prepared: Prepared) -> Path:
    """The session as a run that replays it records it."""
    out = path.with_name(f"{path.stem}-again.mcap")
    with SessionReader(path) as session:
        count = sum(1 for _ in session.frames())
        transport = ReplayTransport(session, prepared.skin, speed=math.inf)
        runner = Runner(prepared, lambda: transport)
        runner.ask(commands.Record(out))
        until = Watch(runner).until
        runner.start()
        until(lambda: runner.status().frames == count)
        runner.stop()
    return out


def places(frames) -> list[tuple[int, int, float, float, float]]:
    """(number of a touched frame, identity, x, y, peak) of every touch."""
    rows = []
    for number, _, touches in frames:
        touch: Touch
        for touch in touches:
            d = touch.detection
            rows.append((number, touch.id, d.x, d.y, d.peak))
    return rows


def table(path: Path) -> list[list[str]]:
    """Rows of a .csv file of touches, without the columns that one of them lacks."""
    with path.open(newline="", encoding="utf-8") as file:
        return [row[:10] for row in csv.reader(file)]


def test_all_ways_are_the_same(session: Path, fitted: Prepared, tmp_path: Path, tomoskin) -> None:
    with SessionReader(session) as reader:
        whole = reconstruct_session(fitted, reader)
    found = places(zip(whole.frames.tolist(), whole.time, whole.touches, strict=True))
    columns = Session(session).touches()
    names = ("frame", "id", "x_m", "y_m", "peak")
    assert found == list(zip(*(columns[name].tolist() for name in names), strict=True))

    one, two = tmp_path / "image.csv", tmp_path / "export.csv"
    code, out, err = tomoskin("image", session, "--touches", one)
    assert code == 0, err
    replayed = again(session, fitted)
    with SessionReader(replayed) as reader:
        assert places(scanned_touches(reader)) == found
    exported = tmp_path / "frames.npz"
    code, _, err = tomoskin("session", "export", replayed, exported, "--touches", two)
    assert code == 0, err
    assert table(one) == table(two)
    held, three = tmp_path / "session.h5", tmp_path / "of_h5.csv"
    code, _, err = tomoskin("session", "export", session, held, "--touches", three)
    assert code == 0, err
    assert table(three) == table(two)
    with h5py.File(held) as file:
        told = file["touches"][:]
        assert list(zip(*(told[c].tolist() for c in ("frame", "id", "x", "y")), strict=True)) == [
            row[:4] for row in found
        ]

    info = session_info(session)
    assert out.startswith(f"{info.frames} frames, ")
    if info.spans:
        again_info = session_info(replayed)
        assert [span.begin for span in info.spans] == [span.begin for span in again_info.spans]
    if "right" not in session.name:
        assert found

    first, plain = tmp_path / "first.csv", tmp_path / "plain.csv"
    code, _, err = tomoskin("image", session, "--reference", "first:20", "--touches", first)
    assert code == 0, err
    assert table(first) == table(one)
    if session.stem in PLAIN:
        voltages = tmp_path / "voltages.npz"
        assert tomoskin("session", "export", session, voltages)[0] == 0
        code, _, err = tomoskin("image", voltages, "--skin", "textile-disc-8", "--touches", plain)
        assert code == 0, err
        assert table(plain) == table(one)


def test_a_calibration_locates_the_same_by_both_commands(
    session: Path, calibration: Path, tmp_path: Path, tomoskin
) -> None:
    if session.stem not in PLAIN:
        pytest.skip("two sessions are enough")
    one, two = tmp_path / "image.csv", tmp_path / "locate.csv"
    for command, out in (("image", one), ("locate", two)):
        code, _, err = tomoskin(command, session, "--calibration", calibration, "--touches", out)
        assert code == 0, err
    assert table(one) == table(two)
    assert len(table(one)) > 1


_TOLD = """import sys; from tomoskin.files.session import Session
print({name: column.tolist() for name, column in Session(sys.argv[1]).touches().items()})"""


def test_the_number_of_threads_changes_nothing(tmp_path: Path) -> None:
    path = tmp_path / "press.mcap"
    simulate(Script.from_toml(HEAD + A), Skin.load("textile-disc-16"), path)
    told = [
        subprocess.run(
            [sys.executable, "-c", _TOLD, str(path)],
            env=os.environ | {"OPENBLAS_NUM_THREADS": threads},
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for threads in "12"
    ]
    assert told[0] == told[1]
    assert "'x_m': []" not in told[0]
