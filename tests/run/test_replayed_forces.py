"""Forces of touches in a recorded run and in its replay."""

from __future__ import annotations

import numpy as np

from run.test_replay import Recorded, recorded_touches, same, touches_of
from tomoskin.core import Detection
from tomoskin.files.session import SessionReader, as_recorded, replayed
from tomoskin.learning import FORCE, AmountModel, LabelledPresses
from tomoskin.pipeline.pipeline import REFERENCE_FRAMES


def test_forces_are_recorded_and_are_the_same_again(prepared, tmp_path):
    rng, path = np.random.default_rng(5), tmp_path / "weighed.mcap"
    newtons = np.linspace(1.0, 12.0, 12)
    weighed = LabelledPresses.of(
        [
            Detection(*rng.uniform(-0.04, 0.04, 2), 1e-3, 1e-3, 4e-4, -0.01 * force, np.empty(0))
            for force in newtons
        ],
        newtons,
        np.arange(12),
        np.arange(12.0),
    )
    model = AmountModel.fit(weighed, prepared.skin)
    weighing = prepared.calibrated(FORCE.of(model, prepared.pattern, prepared.skin))
    with Recorded(weighing, path) as live:
        live.idle(REFERENCE_FRAMES + 5)
        live.touch(0, 8)
        live.idle(3)
    found = recorded_touches(path)
    forces = [row[-1] for rows in found.values() for row in rows]
    assert len(forces) >= 6
    assert all(0 < f.low < f.value < f.high for f in forces)
    assert any(f.high == np.inf for f in forces)  # more than was taught
    with SessionReader(path) as session:
        again = {r.sequence: touches_of(r) for r in replayed(as_recorded(session), session)}
    assert all(same(again[n], rows) for n, rows in found.items())
