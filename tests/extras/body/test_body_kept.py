"""A recording keeps the bends that were known, and begins with frames of a straight sheet."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from run.board import pressed, samples_of
from run.test_replay import Recorded, recorded_touches, same, touches_of
from run.test_runner import Watch
from tomoskin import run as room, server
from tomoskin.cli import main
from tomoskin.core import Frame, Mark
from tomoskin.extras.body import BODY, BodyExamples, BodyModel, BodyReading
from tomoskin.files.session import SessionReader, as_recorded, replayed, session_info
from tomoskin.learning import TOUCH, Locator
from tomoskin.pipeline import Pipeline, prepare
from tomoskin.pipeline.pipeline import REFERENCE_FRAMES
from tomoskin.run.recordings import PreRoll


@pytest.fixture(scope="module")
def bending(prepared):
    """Bends that move the rows as a touch far from those of the test would, and otherwise."""
    random = np.random.default_rng(3)
    rows = prepared.pattern.n_meas
    angle = np.radians([0, 10, 20, 30, 20, 10, 0] * 3)
    shape = 1e-2 * random.standard_normal(rows)
    dv = angle[:, None] * shape + 1e-4 * random.standard_normal((len(angle), rows))
    time, axis = np.arange(len(angle)) / 10, np.full(len(angle), 0.5)
    examples = BodyExamples.checked(dv, time, angle=angle, axis=axis)
    bends = BodyModel.learn(examples, 1e-8 * np.eye(rows))
    return prepared.calibrated(BODY.of(bends, prepared.pattern))


@pytest.fixture(scope="module")
def run(bending, tmp_path_factory):
    path = tmp_path_factory.mktemp("bends") / "run.mcap"
    with Recorded(bending, path) as recorded:
        recorded.idle(REFERENCE_FRAMES + 5)
        recorded.touch(0, 12)
        recorded.idle(6)
        recorded.touch(1, 12)
    return path


def test_a_replay_reads_bends_and_touches_again_to_the_bit(run, bending):
    with SessionReader(run) as session:
        kept = as_recorded(session)
        again = list(replayed(kept, session))
        first = list(replayed(bending, session))
    assert BODY.name in kept.calibrations
    live = recorded_touches(run)
    got = {r.sequence: touches_of(r) for r in again if r.ready}
    assert len(live) > 20
    assert all(same(got[number], rows) for number, rows in live.items())
    angles = [r.readings["body"].angle for r in again if "body" in r.readings]
    assert len(angles) > 20
    assert angles == [r.readings["body"].angle for r in first if "body" in r.readings]


def test_without_them_the_touches_would_be_others(run):
    with SessionReader(run) as session:
        plain = {r.sequence: touches_of(r) for r in replayed(prepare(session.skin), session)}
    live = recorded_touches(run)
    assert any(not same(plain[number], rows) for number, rows in live.items())


def test_what_a_session_holds_is_said(run):
    assert session_info(run).attached == (BODY.attachment,)


def test_a_recording_begun_late_begins_with_frames_of_a_straight_sheet(prepared):
    pipeline, pre_roll = Pipeline(prepared), PreRoll()
    samples = np.full(prepared.scan.n_samples, 300, dtype=np.uint16)
    result = pipeline.push(Frame(0, 0, 0.0, 1, 0, 0, samples))
    bent = BodyReading(
        names=("angle",), values=np.array([0.5]), deviations=np.array([0.01]), angle=0.5, sd=0.01,
        axis=0.0, state="bend", moved=np.zeros(prepared.pattern.n_meas),
    )  # fmt: skip
    states = {"idle": replace(bent, angle=0.0, state="idle"), "bend": bent}
    for number in range(300):
        state = "bend" if number > 200 else "idle"
        frame = Frame(number, number, 0.01 * number, 1, 0, 0, samples)
        pre_roll.frame(frame, Mark.NONE if number else Mark.REFERENCE, 0)
        readings = {BODY.name: states[state]}
        pre_roll.result(replace(result, ready=True, has_image=True, readings=readings))
    frames, _, again = pre_roll.begin(0)
    assert again
    assert len(frames) == 3 * REFERENCE_FRAMES
    assert frames[0][1] == Mark.REFERENCE
    assert max(frame.sequence for frame, _ in frames) <= 200


@pytest.fixture
def calibration(prepared, tmp_path):
    """Places taught by nine presses."""
    along = (-0.03, 0.0, 0.03)
    places = [(x, y) for x in along for y in along]
    samples = [samples_of(prepared)]
    samples += [samples_of(prepared, pressed(prepared, *place)) for place in places]
    frames = [Frame(0, 0, 0.0, 1, 0, 0, one) for one in samples]
    rest, *read = [prepared.readout(frame).values for frame in frames]
    dv = np.array(read) - rest
    locator = Locator.fit(dv, places, pattern=prepared.pattern, skin=prepared.skin)
    path = tmp_path / "c.npz"
    TOUCH.of(locator, prepared.pattern, prepared.skin).write(path)
    return path


@pytest.mark.usefixtures("built_page")
def test_the_command_line_takes_them_beside_a_calibration(run, calibration, monkeypatch, capfd):
    """The command ends where it has shown a bend, and says so in its last line."""
    runners = []

    class Noted(room.Runner):
        def start(self):
            runners.append(self)
            super().start()

    def until_bent(_server, _listener):
        runner = runners[0]
        Watch(runner).until(lambda: "body" in runner.status().readings)

    monkeypatch.setattr(room, "Runner", Noted)
    monkeypatch.setattr(server.Server, "run_on", until_bent)
    source = f"replay:{run}@max"
    with pytest.raises(SystemExit) as end:
        main(["live", "--source", source, "--calibration", str(calibration), "--port", "0",
              "--json"])  # fmt: skip
    out, errors = capfd.readouterr()
    assert (end.value.code or 0, errors) == (0, "")
    assert TOUCH.name in runners[0].prepared.calibrations
    last = json.loads(out.splitlines()[-1])
    assert set(last["bend"]) == {"angle_rad", "sd_rad", "axis_rad", "state", "coordinates"}
    assert last["class"] is None
