"""Forces and depths of touches in a recorded run and in its replay."""

from __future__ import annotations

import numpy as np

from run.test_replay import Recorded, recorded_touches, same, touches_of
from tomoskin.core import Detection
from tomoskin.files.session import SessionReader, as_recorded, replayed
from tomoskin.learning import DEPTH, FORCE, AmountModel, LabelledPresses
from tomoskin.pipeline.pipeline import REFERENCE_FRAMES


def test_forces_and_depths_are_recorded_and_are_the_same_again(prepared, tmp_path):
    rng, path = np.random.default_rng(5), tmp_path / "weighed.mcap"
    newtons = np.linspace(1.0, 12.0, 12)
    pressed = [
        Detection(*rng.uniform(-0.04, 0.04, 2), 1e-3, 1e-3, 4e-4, -0.01 * force, np.empty(0))
        for force in newtons
    ]
    for kind, amount in ((FORCE, newtons), (DEPTH, 1e-4 * newtons)):
        labelled = (pressed, amount, np.arange(12), np.arange(12.0), kind.name)
        model = AmountModel.fit(LabelledPresses.of(*labelled), prepared.skin)
        prepared = prepared.calibrated(kind.of(model, prepared.pattern, prepared.skin))
    with Recorded(prepared, path) as live:
        live.idle(REFERENCE_FRAMES + 5)
        live.touch(0, 8)
        live.idle(3)
    found = recorded_touches(path)
    forces, depths = zip(*(row[-2:] for rows in found.values() for row in rows), strict=True)
    assert len(forces) >= 6
    assert all(0 < f.low < f.value < f.high for f in (*forces, *depths))
    assert any(f.high == np.inf for f in forces)  # more than was taught
    with SessionReader(path) as session:
        again = {r.sequence: touches_of(r) for r in replayed(as_recorded(session), session)}
    assert all(same(again[n], rows) for n, rows in found.items())
