"""Drives one by one: evidence of an onset, a touch that moves, and which drives to ask for."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from sensing.fit.scene import covariance, noise, sheet
from sensing.fit.test_finder import model
from tomoskin.core import FloatArray, finished
from tomoskin.sensing.fit import (
    DriveEvidence,
    DriveFilter,
    Initiation,
    MovingTouch,
    Onset,
    spots_of,
)

DRIVES, SECONDS = 16, 0.006
AT = np.array([0.03, 0.02])


@cache
def evidence() -> DriveEvidence:
    index = sheet().state.model.pattern.drive_index
    stays = np.zeros_like(covariance())
    return finished(DriveEvidence.making(model().candidates, covariance(), stays, index))


def watch() -> Initiation:
    return Initiation(evidence(), evidence().threshold(1 / SECONDS, 5.0), "decrease")


def pressed(at: FloatArray) -> FloatArray:
    return sheet().changes([spots_of(at[None], 0.02, -0.4)])[0]


def test_a_touch_is_told_in_the_second_drive_that_shows_it() -> None:
    initiation, change, rows = watch(), pressed(AT), evidence().rows
    for drive, frame in enumerate(noise(16, DRIVES, 1)):
        assert initiation.push(drive, frame[rows[drive]]) is None
    told = [
        initiation.push(drive, (frame + change)[rows[drive]])
        for drive, frame in enumerate(noise(16, 4, 2))
    ]
    first = next(number for number, onset in enumerate(told) if onset is not None)
    onset = told[first]
    assert 1 <= first <= 3
    assert onset is not None
    off = onset.middle - AT
    assert off @ np.linalg.solve(onset.covariance, off) < 9.2
    assert onset.spot[3] < 0


def test_a_further_touch_shows_in_what_drives_are_off_the_followed_ones() -> None:
    rows, frames = evidence().rows, noise(16, 2 * DRIVES + 4, 7)
    offs = [frame + (k >= 2 * DRIVES) * pressed(AT) for k, frame in enumerate(frames)]

    def told(part: float) -> list[Onset | None]:
        """By drive, where so large a ``part`` of the variance is doubt of the followed ones."""
        initiation, own = watch(), [rows[k % DRIVES] for k in range(len(offs))]
        known = (1 + part) * covariance()
        return [
            initiation.push_beside(here, off[here], known[here, here])
            for here, off in zip(own, offs, strict=True)
        ]

    *none, first, _, _ = told(0.0)
    assert none == [None] * (2 * DRIVES + 1)
    assert first is not None
    assert first.drives == 1
    off = first.middle - AT
    assert off @ np.linalg.solve(first.covariance, off) < 9.2
    assert not any(told(1e6))


def test_windows_have_the_size_that_the_whole_has() -> None:
    order = (3, 1, 0, 2, *range(4, DRIVES))
    own, white = evidence(), np.linalg.cholesky(np.linalg.inv(covariance()))
    squares = np.square(own.signatures @ white).sum(axis=1)
    size, deviation = own.sizes(order)
    np.testing.assert_allclose(size[-1], squares, rtol=1e-6)
    np.testing.assert_allclose(deviation**2, size, rtol=1e-6)


def test_of_drives_that_wait_the_newest_tells_what_all_show() -> None:
    rows, frames = evidence().rows, noise(16, 2 * DRIVES, 6)
    data = [frame + (k >= DRIVES + 4) * pressed(AT) for k, frame in enumerate(frames)]
    one, several = watch(), watch()
    singly, told = [], []
    for number, frame in enumerate(data):
        drive, late = number % DRIVES, number % 3 != 0
        singly.append(one.push(drive, frame[rows[drive]]))
        told.append(several.push(drive, frame[rows[drive]], late=late))
        assert not (late and told[-1])
    begun = next(k for k, onset in enumerate(singly) if onset)
    first, onset = next((k, onset) for k, onset in enumerate(told) if onset)
    assert begun <= first <= begun + 3
    alone = singly[first]
    assert alone is not None
    assert (onset.ratio, onset.drives) == (alone.ratio, alone.drives)


def test_noise_alone_is_no_touch_and_the_threshold_keeps_its_promise() -> None:
    initiation, rows = watch(), evidence().rows
    told = [
        initiation.push(drive, frame[rows[drive]])
        for frame in noise(16, 200, 3)
        for drive in range(DRIVES)
    ]
    assert told == [None] * len(told)
    slow, fast = (evidence().threshold(rate, 5.0) for rate in (10.0, 3000.0))
    assert 5.0 < slow < fast < 8.0
    assert evidence().threshold(10.0, 9.0) == 9.0


def test_a_touch_that_moves_is_followed_without_a_lag() -> None:
    speed, rows, spots = np.array([0.06, -0.03]), evidence().rows, model()
    taking = DriveFilter(spots.solver, spots.prior, "decrease", spots.sheet, covariance())
    spot = spots_of(AT[None], 0.02, -0.4)[0]
    touch = MovingTouch.begin(0.0, spot, 0.01**2 * np.eye(2), spots.prior)
    for number, frame in enumerate(noise(16, 60, 4), start=1):
        time, drive = number * SECONDS, number % DRIVES
        change = pressed(AT + speed * time)
        touch, *odds = taking.pushed(touch.at(time), rows[drive], (frame + change)[rows[drive]])
        assert max(odds) < 3.0
    where, spread = touch.position()
    off = where - (AT + speed * touch.time)
    assert np.hypot(*off) < 0.002
    assert off @ np.linalg.solve(spread, off) < 9.2
    assert touch.state[2:4] == pytest.approx(speed, abs=0.02)
    odds = [
        taking.pushed(touch.at(touch.time + SECONDS), own, frame[own])[1]
        for own, frame in zip(rows, noise(16, DRIVES, 5), strict=True)
    ]
    assert max(odds) > 8.0
    ahead, own = touch.at(touch.time + SECONDS), rows[3]
    part = pressed(AT + speed * ahead.time)[own] * (np.arange(own.stop - own.start) < 6)
    _, gone, going = taking.pushed(ahead, own, part)
    assert going > max(gone, 0.0) + 4.0  # it is lifted while the drive is read
