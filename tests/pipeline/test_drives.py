"""Drives before their frame: a touch is told early by its number, and frames stay as they are."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from run.board import pressed, samples_of
from tomoskin.core import DriveSamples, Frame
from tomoskin.pipeline import DriveResult, FrameResult, Pipeline, Prepared
from tomoskin.pipeline.drives import DriveWatch
from tomoskin.sensing.fit import DriveView

SECONDS, NEEDED = 0.056, 20


@pytest.fixture(scope="module")
def touched(prepared):
    return samples_of(prepared, pressed(prepared, 0.03, 0.02))


@dataclass
class Turns:
    """A board that sends its drives, if ``parts``, and frames."""

    prepared: Prepared
    parts: bool = True
    number: int = 0
    drives: list[DriveResult | None] = field(default_factory=list)
    frames: list[FrameResult | None] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.pipeline = Pipeline(self.prepared, reference_frames=NEEDED)
        self.drive = self.prepared.scan.sample_drive
        self.random = np.random.default_rng(5)

    def turn(self, before, after=None, since=0):
        """One turn of noisy samples, those from drive ``since`` on of what is there ``after``."""
        samples = np.where(self.drive < since, before, before if after is None else after)
        noisy = samples + self.random.integers(-2, 3, len(samples))
        start, count = self.number * SECONDS, int(self.drive.max()) + 1
        for drive in range(count) if self.parts else ():
            time = start + drive * SECONDS / count
            ticks = round(time * 250e3)
            head = self.number, ticks, time + SECONDS / count, 1, 0, 0, 0, drive, drive
            mine = noisy[self.drive == drive].astype(np.uint16)
            self.drives.append(self.pipeline.push_drive(DriveSamples(*head, mine)))
        head = self.number, round(start * 250e3), start + SECONDS, 1, 0, 0
        self.frames.append(self.pipeline.push(Frame(*head, noisy.astype(np.uint16))))
        self.number += 1

    @property
    def told(self):
        return [result.touches if result else () for result in self.drives[-8:]]


@pytest.fixture
def turns(prepared, idle):
    made = Turns(prepared)
    for _ in range(NEEDED + 40):
        made.turn(idle)
    return made


def test_a_touch_is_told_by_drives_and_then_by_the_frame(turns, idle, touched):
    turns.drives.clear()
    turns.turn(idle, touched, since=2)
    told = turns.told
    assert not any(told[:3])
    assert all(told[5:])
    (first,) = next(touches for touches in told if touches)
    assert first.provisional
    frame = turns.frames[-1]
    assert [t.id for t in turns.pipeline.early(frame).touches] == [first.id]
    for _ in range(3):
        turns.turn(touched)
    (touch,) = turns.frames[-1].touches
    assert touch.id == first.id
    (last,) = turns.told[-1]
    assert last.id == touch.id
    assert not last.provisional
    assert np.hypot(last.detection.x - 0.03, last.detection.y - 0.02) < 0.006


def test_a_touch_that_is_lifted_is_told_before_the_frame_ends(turns, idle, touched):
    for _ in range(6):
        turns.turn(touched)
    turns.turn(touched, idle, since=2)
    assert turns.told[0]
    assert not turns.told[-1]
    assert turns.pipeline.early(turns.frames[-1]).touches == ()
    turns.drives.clear()
    for _ in range(6):
        turns.turn(idle)
    assert not any(result.touches for result in turns.drives if result)
    assert turns.frames[-1].touches == ()


def test_a_touch_is_lifted_though_the_drive_that_is_read_meanwhile_still_shows_a_part(
    turns, idle, touched
):
    own = np.flatnonzero(turns.drive == 5)[:3]
    part = idle.copy()
    part[own] = touched[own]
    for _ in range(6):
        turns.turn(touched)
    turns.turn(np.where(turns.drive < 5, touched, part))
    told = turns.told
    assert all(told[:5])
    assert not any(told[6:])


def test_what_no_frame_confirms_is_withdrawn_and_its_number_is_not_given_again(
    turns, idle, touched
):
    number = turns.pipeline.numbered
    drives = turns.drive
    glitch = np.where((drives == 2) | (drives == 3), touched, idle)
    turns.turn(glitch)
    begun = {touch.id for touches in turns.told for touch in touches}
    turns.drives.clear()
    for _ in range(6):
        turns.turn(idle)
    assert not any(turns.told)
    withdrawn = {touch.id for result in turns.drives if result for touch in result.withdrawn}
    assert begun == withdrawn == {number + 1}
    assert turns.pipeline.numbered > number


def test_a_scan_that_saw_a_touch_come_down_looks_like_noise_but_its_release_is_no_later(
    turns, idle, touched, monkeypatch
):
    turns.turn(idle, touched, since=2)
    key, noise = DriveView.key.fget, DriveView.noise
    loud = [replace(excess, level=1e4) for excess in [key(watch_of(turns).view)[3]]]
    monkeypatch.setattr(
        DriveView, "key", property(lambda view: (*key(view)[:3], *loud, key(view)[4]))
    )
    monkeypatch.setattr(DriveView, "noise", lambda view: [1e4 * part for part in noise(view)])
    turns.turn(touched)
    assert all(turns.told)
    turns.turn(touched, idle, since=2)
    assert not turns.told[-1]


@pytest.fixture(scope="module")
def both(prepared):
    sheet = np.minimum(pressed(prepared, 0.03, 0.02), pressed(prepared, -0.05, -0.04))
    return samples_of(prepared, sheet)


def test_a_second_touch_is_told_while_the_first_is_provisional(turns, touched, both):
    turns.turn(touched, both, since=5)
    told = turns.told
    assert max(map(len, told[:5])) == 1
    first, second = told[-1]
    assert first.provisional
    assert second.provisional
    assert second.id == first.id + 1
    for _ in range(6):
        turns.turn(both)
    assert all(len(touches) == 2 for touches in turns.told)
    assert {t.id for t in turns.frames[-1].touches} == {first.id, second.id}
    where = {t.id: t.detection for t in turns.told[-1]}
    assert np.hypot(where[first.id].x - 0.03, where[first.id].y - 0.02) < 0.01
    assert np.hypot(where[second.id].x + 0.05, where[second.id].y + 0.04) < 0.01


def test_a_second_touch_that_frames_do_not_confirm_beside_the_first_is_withdrawn(
    turns, touched, both
):
    drive, number = turns.drive, turns.pipeline.numbered
    turns.turn(np.where((drive == 5) | (drive == 6), both, touched))
    assert number + 2 in {touch.id for touches in turns.told for touch in touches}
    turns.drives.clear()
    for _ in range(9):
        turns.turn(touched)
    assert {touch.id for touches in turns.told for touch in touches} == {number + 1}
    withdrawn = [touch.id for result in turns.drives for touch in result.withdrawn]
    assert withdrawn == [number + 2]
    assert turns.pipeline.numbered == number + 2


def test_a_drive_that_shows_a_further_touch_does_not_move_the_first_there(turns, touched):
    turns.turn(touched)
    (followed,) = watch_of(turns)._followed.values()
    known = followed.moving
    elsewhere = replace(known, state=known.state + np.array([0.08, *np.zeros(7)]))
    followed.take(known, elsewhere, -1.0, -1.0)
    assert followed.moving is known
    late = replace(known, time=known.time + 0.3)  # when no further one is looked for
    followed.take(late, elsewhere, -1.0, -1.0)
    assert followed.moving is elsewhere


def test_what_drives_follow_goes_to_the_touch_of_the_frame_that_is_there(turns, touched):
    """A fit of half a scan has put it elsewhere, and the next one shows it as a further touch."""
    for _ in range(6):
        turns.turn(touched)
    (touch,) = turns.frames[-1].touches
    d = touch.detection
    elsewhere = replace(touch, detection=replace(d, x=d.x - 0.05, sd_x=0.05, sd_y=0.05))
    further = replace(touch, id=touch.id + 1)
    watch_of(turns).confirm([elsewhere, further], (turns.number - 1) * SECONDS, further.id)
    turns.turn(touched)
    assert all(further.id in {t.id for t in touches} for touches in turns.told)


def watch_of(turns) -> DriveWatch:
    return turns.pipeline._state._drives


def test_frames_are_to_the_bit_what_they_are_without_drives(turns, prepared, idle, touched):
    alone = Turns(prepared, parts=False)
    for _ in range(NEEDED + 40):
        alone.turn(idle)
    for each in (turns, alone):
        each.turn(idle, touched, since=3)
        for _ in range(5):
            each.turn(touched)
        each.turn(touched, idle, since=4)
    for ours, other in zip(turns.frames, alone.frames, strict=True):
        assert [(t.id, t.detection.x, t.detection.sd_x) for t in ours.touches] == [
            (t.id, t.detection.x, t.detection.sd_x) for t in other.touches
        ]


def test_drives_tell_nothing_before_a_reference_stands_nor_of_another_scan(prepared, idle):
    turns = Turns(prepared)
    turns.turn(idle)
    assert turns.drives == [None] * len(turns.drives)
    part = DriveSamples(0, 0, 0.0, 1, 0, 0, 0, 0, 0, np.zeros(3, np.uint16))
    assert turns.pipeline.push_drive(part) is None


def test_where_a_press_was_there_at_the_reference_drives_begin_no_touches(prepared, idle, touched):
    """Frames say what the lifted one left; drives would see touches all round it."""
    turns = Turns(prepared)
    for _ in range(NEEDED + 3):
        turns.turn(touched)
    for _ in range(60):
        turns.turn(touched, idle) if turns.number == NEEDED + 3 else turns.turn(idle)
        assert not turns.frames[-1].touches
    assert "risen" in turns.frames[-1].problem
    assert sum(bool(result and result.touches) for result in turns.drives[-8 * 50 :]) == 0
