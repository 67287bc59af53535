"""Recording at 1,000 frames/s for ten minutes at their own pace: ten minutes, as they come."""

from __future__ import annotations

import tempfile
from pathlib import Path

from report import Report
from session import LONG, RECORDED, SEED, SKIN, frames_of, recorded
from tomoskin.model.skin import Skin


def run(data: Path | None) -> tuple[Report, ...]:
    """One case; ``data`` is not needed."""
    del data
    skin = Skin.load(SKIN)
    with tempfile.TemporaryDirectory() as folder:
        row = recorded(Path(folder) / "paced.mcap", skin, frames_of(skin), LONG, paced=True)
    return (
        Report(
            "recording at its own pace",
            RECORDED,
            (row,),
            (
                f"{SKIN}, seed {SEED}; processor time of the whole process, which also makes the "
                "frames, by the seconds recorded",
            ),
        ),
    )
