"""A session for those who compute with it: frames, table, voltages."""

from __future__ import annotations

import numpy as np
import pytest

from tomoskin import Session
from tomoskin.core import DataError
from tomoskin.files.exports import write_touches
from tomoskin.files.session import SessionReader, as_recorded, replayed
from tomoskin.model.skin import Skin
from tomoskin.run import simulate
from tomoskin.twin import Script

SCRIPT = """
format = 1
[script]
duration = "1.2 s"
lead_in = "1.2 s"
[[press]]
id = "finger"
radius = "15 mm"
at = ["30 mm", "20 mm"]
start = "0.2 s"
force = "4 N"
hold = "0.4 s"
"""


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    path = tmp_path_factory.mktemp("session") / "press.mcap"
    simulate(Script.from_toml(SCRIPT), Skin.load("textile-disc-8"), str(path), seed=3)
    return Session(str(path))


@pytest.fixture(scope="module")
def frames(session):
    return list(session)


def test_a_loop_gives_what_a_replay_gives(session, frames):
    first = [(f.sequence, f.ready, [t.detection.x for t in f.touches]) for f in frames]
    with SessionReader(session.path) as reader:
        replay = [
            (f.sequence, f.ready, [t.detection.x for t in f.touches])
            for f in replayed(as_recorded(reader), reader)
        ]
    assert first == replay
    ready = [is_ready for _, is_ready, _ in first]
    assert not ready[0]
    assert ready[-1]
    assert any(touches for _, _, touches in first)


def test_images_are_of_its_mesh_and_voltages_of_its_pattern(session, frames):
    assert {f.image.mesh_id for f in frames} == {session.mesh.identity}
    read = session.voltages()
    assert read.voltages.shape == (len(frames), session.skin.pattern().n_meas)
    assert read.voltages[-1] == pytest.approx(frames[-1].voltages)


def test_the_table_has_a_row_for_each_touch_of_each_frame(session, frames, tmp_path):
    table = session.touches()
    touched = [(n, t) for n, f in enumerate(frames) for t in f.touches]
    assert table["frame"].tolist() == [n for n, _ in touched]
    assert table["x_m"].tolist() == [t.detection.x for _, t in touched]
    assert table["kind"].tolist() == [t.said for _, t in touched]
    assert "decrease" in table["kind"]
    assert table["time_s"] == pytest.approx(session.voltages().time[table["frame"]])
    assert np.hypot(table["x_m"][-5:].mean() - 0.03, table["y_m"][-5:].mean() - 0.02) < 0.006
    assert {values.dtype.kind for values in table.values()} == {"i", "f", "U"}
    rows = [(n, time, (t,)) for (n, t), time in zip(touched, table["time_s"], strict=True)]
    write_touches(tmp_path / "x.csv", rows)
    header = (tmp_path / "x.csv").read_text().splitlines()[0]
    assert header.split(",") == list(table)


def test_what_is_no_session_is_said_at_once(tmp_path):
    with pytest.raises(DataError, match="there is no such file"):
        Session(tmp_path / "none.mcap")
