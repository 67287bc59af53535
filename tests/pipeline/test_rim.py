"""A press at the rim: no touch is told off the sheet."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tomoskin.files.session import SessionReader, as_recorded, replayed
from tomoskin.model.mesh import Disc
from tomoskin.model.skin import Skin
from tomoskin.run import simulate
from tomoskin.twin import Script

PRESSES = """format = 1
[script]
duration = "2800 ms"
lead_in = "1400 ms"
""" + "".join(
    f"""[[press]]
id = "{k}"
radius = "20 mm"
at = ["{99 * np.cos(np.deg2rad(angle)):.2f} mm", "{99 * np.sin(np.deg2rad(angle)):.2f} mm"]
start = "{100 + 600 * k} ms"
force = "{1 + k} N"
hold = "300 ms"
"""
    for k, angle in enumerate((22, 67, 100, 200))
)


def test_no_touch_is_told_off_the_sheet(tmp_path: Path) -> None:
    skin = Skin.load("textile-disc-16")
    assert isinstance(skin.outline, Disc)
    simulate(Script.from_toml(PRESSES), skin, tmp_path / "rim.mcap", seed=3)
    with SessionReader(tmp_path / "rim.mcap") as session:
        results = list(replayed(as_recorded(session), session))
    touches = [touch for result in results for touch in result.touches]
    touches += [event.touch for result in results for event in result.events]
    far = np.array([np.hypot(t.detection.x, t.detection.y) for t in touches])
    assert len({touch.id for touch in touches}) >= 3
    assert far.max() <= skin.outline.radius * (1 + 1e-12)
    assert np.isclose(far, skin.outline.radius, rtol=1e-9, atol=0).any()  # some were moved
