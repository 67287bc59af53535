"""Touches that are told lie on the sheet."""

from __future__ import annotations

import numpy as np
import pytest

from tomoskin.core import Detection, Touch
from tomoskin.model.mesh import Disc, Outline, Polygon, Rectangle
from tomoskin.sensing.track import Rim, TouchEvent, Tracker

BOOMERANG = Polygon(np.array([[0.0, 0.0], [0.1, 0.05], [0.0, 0.02], [-0.1, 0.05]]))


def touch_at(x: float, y: float) -> Touch:
    detection = Detection(x, y, 2e-3, 1e-3, 1e-3, -0.1, np.empty(0, np.int64), 1e-6, snr=40.0)
    return Touch(1, "decrease", 0.0, detection)


@pytest.mark.parametrize(
    ("outline", "place", "expected"),
    [
        (Disc(0.1), (0.0, -0.12), (0.0, -0.1)),
        (Disc(0.1), (0.03, -0.04), (0.03, -0.04)),
        (Rectangle(0.2, 0.1), (0.15, 0.02), (0.1, 0.02)),
        (Rectangle(0.2, 0.1), (-0.2, 0.3), (-0.1, 0.05)),
        (BOOMERANG, (0.0, 0.04), None),  # between its arms: on the nearer of their edges
    ],
    ids=str,
)
def test_a_position_off_the_sheet_moves_to_the_nearest_of_its_rim(
    outline: Outline, place: tuple[float, float], expected: tuple[float, float] | None
) -> None:
    touch = touch_at(*place)
    moved = Rim.of(outline).on_sheet(touch).detection
    assert (moved.sd_x, moved.sd_y, moved.cov_xy) == (2e-3, 1e-3, 1e-6)
    if expected is not None:
        assert (moved.x, moved.y) == pytest.approx(expected, abs=1e-9)
        return
    rim = outline.polyline(1e-4)
    nearest = np.linalg.norm(rim - place, axis=1).min()
    assert np.hypot(moved.x - place[0], moved.y - place[1]) == pytest.approx(nearest, abs=1e-6)


def test_a_tracker_tells_touches_and_events_on_the_sheet_and_follows_them_where_they_are() -> None:
    tracker = Tracker()
    tracker.rim = Rim.of(Disc(0.1))
    touches: list[Touch] = []
    events: list[TouchEvent] = []
    for number in range(12):
        found = [touch_at(0.104, 0.0).detection] if number < 6 else []
        touches += tracker.update(found, 0.05 * number, 0.05 * number)
        events += tracker.events
        if tracker.responses:
            assert tracker.responses[0].detection.x > 0.102
    assert touches
    assert {event.kind for event in events} >= {"onset", "release"}
    for touch in [*touches, *(event.touch for event in events)]:
        assert touch.detection.x == pytest.approx(0.1, abs=1e-9)
