"""Scene and state as a page needs them."""

import json
from pathlib import Path

import numpy as np
import pytest

from tomoskin.core import Event
from tomoskin.imaging import AlphaChoice
from tomoskin.pipeline import colour_limit, prepare
from tomoskin.pipeline.frame_result import ReferenceState
from tomoskin.run.status import Status
from tomoskin.sensing.signal import BaselineState, ElectrodeHealth
from tomoskin.server import views
from tomoskin.server.page_messages import Refusal


def make_status(**changes):
    fields = {
        "source": "twin of a skin",
        "running": True,
        "paused": False,
        "frames": 10,
        "fps": 50.0,
        "dropped": 1,
        "corrupt": 2,
        "gaps": 3,
        "late": 4,
        "deaf": 5,
        "p50": 0.0005,
        "p99": 0.001,
        "reference": ReferenceState(20, 20, 5.0, 1e-4),
        "reference_age": 2.0,
        "choice": AlphaChoice(0.06, "light-touch", "said so"),
        "left_out": 0,
        "problem": None,
    }
    return Status(**(fields | changes))


def test_scene(prepared):
    scene = json.loads(views.scene(prepared, "twin", limit=0.1, pressable=True).json)
    mesh = prepared.mesh
    np.testing.assert_array_equal(np.reshape(scene["points"], (-1, 2)), mesh.points)
    np.testing.assert_array_equal(np.reshape(scene["cells"], (-1, 3)), mesh.cells)
    assert [e["label"] for e in scene["electrodes"]] == [f"E{n}" for n in range(1, 9)]
    radius = np.hypot(*np.reshape(scene["outline"], (-1, 2)).T)
    np.testing.assert_allclose(radius, 0.1, rtol=1e-3)
    assert scene["unit"] == "S"
    assert scene["limit"] == 0.1
    assert scene["pattern"]["n_meas"] == 40
    assert len(scene["pattern"]["drive"]) == len(scene["pattern"]["measure"]) == 80
    assert scene["skin"]["name"] == "textile-disc-8"
    assert scene["solid"] is None


def test_a_sheet_on_a_surface_is_told_in_space(prepared):
    skin = prepared.skin.altered(
        {"surface": {"shape": "cylinder", "radius": "60 mm"}, "mesh": {"cells": 300}}
    )
    scene = json.loads(views.scene(prepare(skin), "twin", limit=0.1, pressable=True).json)
    solid = np.reshape(scene["solid"], (-1, 3))
    flat = np.reshape(scene["points"], (-1, 2))
    assert len(solid) == len(flat)
    edge = np.linalg.norm(solid[scene["cells"][0]] - solid[scene["cells"][1]])
    assert edge == pytest.approx(
        np.linalg.norm(flat[scene["cells"][0]] - flat[scene["cells"][1]]), rel=1e-2
    )
    assert np.ptp(solid, axis=0).max() < np.ptp(flat, axis=0).max() + 1e-9
    assert scene["probe"]["radius_m"] == 0.015


def test_electrode_points_run_along_the_arc(prepared):
    scene = json.loads(views.scene(prepared, "twin", limit=0.1, pressable=True).json)
    for electrode in scene["electrodes"]:
        along = prepared.mesh.points[electrode["points"]]
        steps = np.linalg.norm(np.diff(along, axis=0), axis=1)
        assert steps.sum() == pytest.approx(0.01, rel=0.01)
        assert np.linalg.norm(along.mean(axis=0) - (electrode["x"], electrode["y"])) < 2e-3


def test_state():
    state = json.loads(views.state(make_status()).json)
    assert state["p99_ms"] == 1.0
    assert state["reference"] == {"frames": 20, "needed": 20, "age_s": 2.0, "ready": True}
    assert (state["alpha"], state["rule"]) == (0.06, "light-touch")
    assert state["problem"] is None
    assert state["recording"] is None
    assert "50 frames/s" in state["text"]


def test_sick_electrodes_and_the_drift_of_the_reference_are_told():
    start, deviation = np.ones(4), np.full(4, 1e-4)
    baseline = BaselineState(
        start, 1.012 * start, deviation, (4 * deviation) ** 2, 20, held=30.0, followed=0.0
    )
    reference = ReferenceState(20, 20, 5.0, 1e-4, baseline)
    sick = ElectrodeHealth(4, "open", "no current", 3.5)
    status = make_status(reference=reference, electrodes=(sick,))
    state = json.loads(views.state(status).json)
    assert state["baseline"] == {
        "drift": pytest.approx(0.012),
        "held_s": 30.0,
        "noise_v": pytest.approx(1e-4),
        "stale": baseline.stale,
    }
    assert "30 s" in state["baseline"]["stale"]
    assert state["sick"] == [
        {"electrode": 4, "state": "open", "reason": "no current", "since": 3.5}
    ]
    assert "drift 1.2 %" in status.text


def test_of_a_recording_only_the_files_name_is_told():
    state = json.loads(views.state(make_status(recording=Path("folder") / "run.mcap")).json)
    assert state["recording"] == "run.mcap"


def test_what_is_not_known_is_null():
    unknown = make_status(p50=float("nan"), p99=float("nan"), reference=ReferenceState(3, 20))
    state = json.loads(views.state(unknown).json)
    assert state["p50_ms"] is None
    assert state["noise_v"] is None
    assert "3 of 20" in state["text"]


def test_the_line_of_state_says_the_problem_first():
    assert "unplugged" in make_status(problem="unplugged", paused=True).text
    assert "paused" in make_status(paused=True).text


def test_whatever_a_file_is_called_the_state_is_told():
    status = make_status(source="skin on replay:\udcff.mcap", recording=Path("r\udcff.mcap"))
    told = json.loads(views.state(status).json)
    assert told["recording"] == "r?.mcap"
    assert told["text"].startswith("skin on replay:?.mcap")


def test_event_and_error():
    event = json.loads(views.event(Event(1.5, "lost", "2 frames lost")).json)
    assert event == {"type": "event", "time_s": 1.5, "kind": "lost", "text": "2 frames lost"}
    assert json.loads(Refusal(message="what?").json) == {"type": "error", "message": "what?"}


def test_the_scale_ends_at_a_round_number_that_a_firm_press_fills(prepared):
    limit = colour_limit(prepared)
    assert limit in (0.05, 0.1, 0.2)
