"""A recording that begins after the settings were changed replays to the bit."""

from __future__ import annotations

import pytest

from run.test_replay import Recorded, recorded_touches, touches_of
from tomoskin.core import Mark
from tomoskin.files.session import SessionReader, as_recorded, replayed
from tomoskin.pipeline import prepare
from tomoskin.pipeline.pipeline import REFERENCE_FRAMES
from tomoskin.run import commands

SOON, LATE = (3, 0), (70, 0)
"""Untouched frames before the change and after it."""


@pytest.mark.parametrize(
    ("changes", "untouched"),
    [
        ({"inverse": {"alpha": 0.3}}, SOON),
        ({"inverse": {"alpha": 0.3}}, (10, 40)),
        ({"inverse": {"alpha": 0.3}}, LATE),
        ({"inverse": {"alpha": "auto"}, "touch": {"gamma1": 0.7}}, (70, 30)),
        ({"inverse": {"time_constant": "50 ms"}}, LATE),
        ({"touch": {"method": "fit"}}, LATE),
    ],
)
def test_replayed_to_the_bit(prepared, tmp_path, changes, untouched):
    """However long the reference stood before the change, and the settings after it; from the
    newest untouched frames where there are enough, the reference's own where not."""
    path, (before, after) = tmp_path / "later.mcap", untouched
    with Recorded(prepared, tmp_path / "whole.mcap") as live:
        live.idle(REFERENCE_FRAMES + before)
        live.touch(0, 6)
        live.runner.ask(commands.Adopt(prepare(prepared.skin.altered(changes), prepared)))
        live.idle(after)
        live.drift(3)
        live.touch(0, 4)
        live.runner.ask(commands.Record(path))
        live.touch(0, 6)
        live.idle(8)
        live.touch(1, 8)
    recorded = recorded_touches(path)
    assert recorded
    with SessionReader(path) as session:
        early = [item.frame for item in session.frames() if item.mark & Mark.EARLIER]
        found = {r.sequence: touches_of(r) for r in replayed(as_recorded(session), session)}
    assert len(early) >= REFERENCE_FRAMES
    enough = before + after >= REFERENCE_FRAMES + 5
    assert (early[0].sequence > 0) == enough
    assert {n: rows for n, rows in found.items() if rows or n in recorded} == recorded
