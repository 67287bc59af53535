"""How a sheet is deformed in session files and tables, read by programs that know nothing of us."""

from __future__ import annotations

import csv
import json
import math
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
from mcap.reader import make_reader

from cli.conftest import Run, tomoskin
from files.session.runs import FOLD, SKIN, STRETCH, TOUCH
from tomoskin.core import Image, encode_json
from tomoskin.files.exports import write_deformations
from tomoskin.files.messages import (
    deformation_content,
    deformation_of,
    deformation_spans,
    deformation_state,
)
from tomoskin.files.session import Recorder, SessionReader, SessionWriter, session_info
from tomoskin.pipeline import FrameResult
from tomoskin.run import simulate
from tomoskin.sensing.fit import Deformation, EstimatedNumber
from tomoskin.twin import Script

__all__ = ["tomoskin"]

BEND = """format = 1
[script]
duration = "1500 ms"
lead_in = "1400 ms"
[[bend]]
length = "60 mm"
angle = "20 deg"
start = "100 ms"
rise = "200 ms"
hold = "1000 ms"
fall = "100 ms"
"""

UNKNOWN = Deformation("unknown", None, "relative")
COMMON = Deformation(
    "common", EstimatedNumber(-0.1, -0.12, -0.08), "relative", confused="warmth, gain or supply"
)


def result_at(host_time: float, told: Deformation | None) -> FrameResult:
    """What a pipeline makes of one frame without touches."""
    rows = np.zeros(SKIN.pattern().n_meas)
    return FrameResult(
        sequence=round(10 * host_time), host_time=host_time, ready=True, has_image=True,
        image=Image(np.zeros(1), "S", ""), voltages=rows, reference=rows, touches=(), left_out=0,
        deformation=told,
    )  # fmt: skip


@pytest.fixture
def session(tmp_path: Path) -> Path:
    """Frames of 1.0 to 1.4 s: flat, bent twice, stretched, flat."""
    path = tmp_path / "bent.mcap"
    recorder = Recorder(path, lambda: SessionWriter(path, SKIN), None, lambda *_: None)
    recorder.open()
    for number, told in enumerate((None, FOLD, FOLD, STRETCH, None, None)):
        if (parts := recorder.admit(result_at(1.0 + number / 10, told))) is not None:
            recorder.take(parts)
    recorder.close()
    return path


@pytest.mark.parametrize("told", [FOLD, STRETCH, COMMON, UNKNOWN], ids=lambda told: told.kind)
def test_a_document_says_all_of_it(told: Deformation) -> None:
    content = json.loads(encode_json(deformation_content(told)))
    assert deformation_of(content) == told
    assert content["text"] == told.text


def test_a_plain_reader_finds_it_with_the_touches_of_its_frame(session: Path) -> None:
    with session.open("rb") as file:
        found = [
            json.loads(message.data)
            for _, channel, message in make_reader(file).iter_messages(topics=["/touches"])
            if channel.topic == "/touches"
        ]
    assert [one["host_time"] for one in found] == [1.1, 1.2, 1.3, 1.4]  # the last: it has ended
    assert [one.get("deformation", {}).get("kind") for one in found] == [
        "fold", "fold", "stretch", None,
    ]  # fmt: skip
    axis = found[0]["deformation"]["axis"]
    assert (axis["low"], axis["value"], axis["high"]) == (0.4, 0.5, 0.6)
    assert found[0]["deformation"]["offset"]["value"] == 0.02


def test_a_session_gives_it_back_and_says_when_it_was(session: Path) -> None:
    with SessionReader(session) as reader:
        assert [one.deformation for one in reader.touches()] == [FOLD, FOLD, STRETCH, None]
    spans = session_info(session).deformations
    assert [(one.begin, one.end, one.deformation.kind) for one in spans] == [
        (1.1, 1.2, "fold"), (1.3, 1.3, "stretch"),
    ]  # fmt: skip


def test_the_table_has_a_row_a_frame_and_an_interval_a_number(tmp_path: Path) -> None:
    path = tmp_path / "x.csv"
    frames = [(3, 0.5, None), (4, 0.6, FOLD), (None, 0.7, COMMON)]
    assert write_deformations(path, frames) == 2
    with path.open(newline="") as file:
        fold, common = csv.DictReader(file)
    assert (fold["frame"], fold["time_s"], fold["kind"], fold["unit"]) == (
        "4", "0.600000", "fold", "rad",
    )  # fmt: skip
    assert [float(fold[f"axis{part}_rad"]) for part in ("_low", "", "_high")] == [0.4, 0.5, 0.6]
    assert float(fold["amount"]) == pytest.approx(0.35)
    assert (fold["across"], fold["confused"]) == ("", "")
    assert (common["frame"], common["axis_rad"]) == ("", "")
    assert common["confused"] == "warmth, gain or supply"


def test_a_span_shows_the_frame_in_which_it_is_largest() -> None:
    assert FOLD.amount is not None
    large = replace(FOLD, amount=replace(FOLD.amount, value=-0.9))
    (span,) = deformation_spans([(0.0, FOLD), (0.1, large), (0.2, FOLD), (0.3, None)])
    assert (span.begin, span.end, span.deformation) == (0.0, 0.2, large)
    assert len(deformation_spans([(0.0, FOLD), (0.1, None), (0.2, FOLD)])) == 2


def test_numbers_alone_say_kind_and_unit_too() -> None:
    state = deformation_state(FOLD)
    assert (state["kind"], state["unit"], state["offset_m"]) == (1, 2, 0.02)
    none = deformation_state(None)
    assert none.pop("kind") == 0
    assert all(map(math.isnan, none.values()))
    assert list(state) == ["kind", *none]


def test_info_says_it(session: Path, tomoskin: Run) -> None:
    _, out, _ = tomoskin("session", "info", session)
    assert FOLD.text in out
    code, out, _ = tomoskin("session", "info", session, "--json")
    fold, stretch = json.loads(out)["deformations"]
    assert (code, fold["deformation"]["kind"], stretch["begin"]) == (0, "fold", 1.3)


def test_every_way_from_a_session_tells_the_same(tmp_path: Path, tomoskin: Run) -> None:
    path, one, two, whole = (tmp_path / name for name in ("x.mcap", "1.csv", "2.csv", "x.h5"))
    simulate(Script.from_toml(BEND), SKIN, path)
    code, out, _ = tomoskin("image", path, "--json", "--deformations", one)
    assert code == 0
    told = json.loads(out)["deformations"]
    assert len(told) > 10
    assert {one["kind"] for one in told} == {"fold"}
    assert tomoskin("session", "export", path, whole, "--deformations", two)[0] == 0
    assert one.read_text() == two.read_text()
    with one.open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [int(row["frame"]) for row in rows] == [item["frame"] for item in told]
    axes = [item["axis"]["value"] for item in told]
    assert [float(row["axis_rad"]) for row in rows] == pytest.approx(axes, rel=1e-5)
    with h5py.File(whole) as file:
        assert file["deformations"]["axis_rad"].tolist() == pytest.approx(axes)
        assert set(file["deformations"]["kind"]) == {b"fold"}


def test_a_touch_on_it_stays(tmp_path: Path) -> None:
    path = tmp_path / "x.mcap"
    with SessionWriter(path, SKIN) as writer:
        writer.touches(1.0, 7, (TOUCH,), FOLD)
        writer.touches(1.1, 8, (TOUCH,))
    with SessionReader(path) as reader:
        both, alone = reader.touches()
    assert (both.touches[0].id, both.deformation) == (TOUCH.id, FOLD)
    assert (alone.touches[0].id, alone.deformation) == (TOUCH.id, None)
