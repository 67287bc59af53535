"""The Rerun sink: its recordings are read back, from files and from a viewer that writes one.

The package is large (490 MB), so that the usual set-up leaves it out.
"""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import subprocess
import sys
import time
import warnings
from dataclasses import replace

import numpy as np
import pytest

from cli.conftest import tomoskin
from files.session.runs import FOLD, TOUCH
from run.sinks.conftest import (
    EPOCH,
    EVENT,
    MESH,
    PATIENCE,
    SCRIPT,
    VALUES,
    begin,
    free_port,
    stream,
    touch_of,
)
from tomoskin.core import CHANGE, OutputError, SinkError
from tomoskin.extras.rerun.rerun_sink import open_rerun
from tomoskin.files.session import SessionReader, as_recorded, replayed

pytest.importorskip("rerun", reason="rerun-sdk is not installed: pip install 'tomoskin[rerun]'")

__all__ = ["stream", "tomoskin"]


@pytest.fixture
def whole(stream):
    """A stream with the sheet in space, and a clock."""
    flat = np.column_stack([MESH.points, np.zeros(len(MESH.points))])
    return replace(stream, corners=flat[MESH.cells], limit=0.5, clock=lambda: 0.5)


def entities(path):
    """Rows of each entity and component: (times or None, values)."""
    from rerun.chunk import RrdReader

    found = {}
    for chunk in RrdReader(str(path)).stream().to_chunks():
        batch = chunk.to_record_batch()
        columns = dict(zip(batch.schema.names, batch.columns, strict=True))
        times = columns["time"].cast("int64").to_pylist() if "time" in columns else None
        for name, column in columns.items():
            if ":" in name:
                rows = found.setdefault((chunk.entity_path, name.partition(":")[2]), [])
                rows.extend(zip(times or [None] * len(column), column.to_pylist(), strict=True))
    return found


def test_a_file_holds_sheet_touches_and_series(tmp_path, whole):
    path = tmp_path / "run.rrd"
    sink = open_rerun(f"{path},namespace=left_arm")
    contacts_at = begin(sink, whole)
    sink.publish(replace(contacts_at(0.25, TOUCH, touch_of(5)), deformation=FOLD))
    sink.publish(EVENT)
    sink.publish(contacts_at(0.5))
    sink.close()
    sink.close()
    found = entities(path)
    ((_, corners),) = found["/left_arm/sheet", "vertex_positions"]
    assert np.allclose(np.array(corners)[:, :2], MESH.points[MESH.cells].reshape(-1, 2), atol=1e-6)
    colours = found["/left_arm/sheet", "vertex_colors"][0][1]
    lowest = int(np.argmin(VALUES))  # −1, beyond the scale's end
    assert colours[3 * lowest] >> 8 == int.from_bytes(CHANGE.table[0].tobytes())
    (begun, places), (ended, none) = found["/left_arm/touches", "positions"]
    assert (begun, ended) == tuple(round(1e9 * (EPOCH + t)) for t in (0.25, 0.5))
    assert np.allclose(places, [[TOUCH.detection.x, TOUCH.detection.y, 0]] * 2)
    assert none == []
    assert found["/left_arm/touches", "labels"][0][1] == ["4", "5"]
    assert np.allclose(found["/left_arm/normals", "vectors"][0][1], [[0, 0, 0.02]] * 2)
    assert [value for _, value in found["/left_arm/latency", "scalars"]] == [[0.25], [0.0]]
    assert found["/left_arm/peak/4", "scalars"][0][1] == [TOUCH.detection.peak]
    assert found["/left_arm/peak/4", "is_recursive"][0][0] == ended  # its line ends here
    assert found["/left_arm/deformation/offset_m", "scalars"][0][1] == [0.02]
    assert found["/left_arm/deformation/offset_m", "is_recursive"][0][0] == ended
    assert [value for _, value in found["/left_arm/deformation/kind", "scalars"]] == [[1], [0]]
    assert found["/left_arm/events", "text"][0][1] == ["connected: board 01"]


def test_a_file_that_is_there_stays(tmp_path, whole):
    path = tmp_path / "run.rrd"
    path.write_bytes(b"mine")
    sink = open_rerun(str(path))
    with pytest.raises(OutputError):
        sink.open(whole)
    sink.close()
    assert path.read_bytes() == b"mine"


def test_a_body_is_no_sheet(tmp_path, stream):
    body = replace(stream, points=np.zeros((4, 3)))
    with pytest.raises(SinkError, match="this skin is a body"):
        open_rerun(str(tmp_path / "run.rrd")).open(body)


def test_a_viewer_gets_the_same(tmp_path, whole):
    path, port = tmp_path / "heard.rrd", free_port()
    viewer = subprocess.Popen(
        [sys.executable, "-m", "rerun", "--save", str(path), "--port", str(port)],
        stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL, start_new_session=True,
    )  # fmt: skip
    try:
        wait_for(viewer, port)
        sink = open_rerun(f"127.0.0.1:{port}")
        contacts_at = begin(sink, whole)
        sink.publish(contacts_at(0.25, TOUCH))
        sink.close()
        assert labels_of(viewer, path) == ["4"]
    finally:
        os.killpg(viewer.pid, signal.SIGKILL)  # it has started another program, which is the viewer
        viewer.wait(PATIENCE)


def wait_for(viewer, port):
    """Until the viewer listens."""
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline:
        assert viewer.poll() is None
        with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", port)):
            return
        time.sleep(0.05)
    raise AssertionError("the viewer does not listen")


def test_a_viewer_that_is_not_there_is_said(whole, monkeypatch):
    monkeypatch.setattr("tomoskin.run.sinks.rerun._PATIENCE", 0.2)
    sink = open_rerun(f"127.0.0.1:{free_port()}")
    contacts_at = begin(sink, whole)
    sink.publish(contacts_at(0.25, TOUCH))
    with pytest.raises(SinkError, match="no viewer accepted the connection"):
        sink.close()
    sink.close()


def labels_of(viewer, path):
    """Of the touches, once they stand in a file that a viewer is still writing."""
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline:
        assert viewer.poll() is None
        with contextlib.suppress(Exception), warnings.catch_warnings():  # it has no end yet
            warnings.simplefilter("ignore")
            return entities(path)["/tomoskin/touches", "labels"][0][1]
        time.sleep(0.1)
    raise AssertionError("the viewer got no touches")


def test_an_export_holds_the_touches_of_a_session(tomoskin, tmp_path):
    (tmp_path / "press.toml").write_text(SCRIPT, encoding="utf-8")
    session, path = tmp_path / "press.mcap", tmp_path / "run.rrd"
    assert tomoskin("simulate", "--script", tmp_path / "press.toml", "--out", session)[0] == 0
    assert tomoskin("session", "export", session, path, "--every", "0.2")[0] == 0
    found = entities(path)
    with SessionReader(session) as reader:
        results = list(replayed(as_recorded(reader), reader))
    expected = [(round(1e9 * r.host_time), t) for r in results for t in r.touches]
    written = [
        (time, place)
        for time, places in found["/tomoskin/touches", "positions"]
        for place in places
    ]
    assert [time for time, _ in written] == [time for time, _ in expected]
    wanted = [(touch.detection.x, touch.detection.y, 0) for _, touch in expected]
    assert np.allclose([place for _, place in written], wanted, atol=1e-6)
    assert len(found["/tomoskin/sheet", "vertex_colors"]) >= 2


@pytest.mark.parametrize(
    ("argument", "name"),
    [
        ("", "rerun 127.0.0.1:9876"),
        ("robot:9900", "rerun robot:9900"),
        ("run.rrd,namespace=left_arm", "rerun run.rrd"),
    ],
)
def test_where_it_goes(argument, name):
    assert open_rerun(argument).name == name


@pytest.mark.parametrize("argument", ["robot:port", "run.rrd,frame=x", "run.rrd,namespace=a b"])
def test_what_cannot_be_meant(argument):
    with pytest.raises(SinkError, match="expected"):
        open_rerun(argument)
