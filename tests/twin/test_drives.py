"""The twin's drives one by one: what its whole scans hold, sooner."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tomoskin.board.source import Link, ScanSettings
from tomoskin.core import DriveSamples, Frame, VirtualClock
from tomoskin.model.pattern import Scan
from tomoskin.model.skin import Skin
from tomoskin.twin import Press, TwinSettings, make_twin

SKIN = Skin.load("textile-disc-8")
SCAN = Scan.of(SKIN.pattern())


def played(singly, frames, *, press=True):
    """What a twin without noise sends; it is pressed from its first frame on."""
    clock = VirtualClock()
    twin = make_twin(SKIN, TwinSettings.preset("ideal").with_noise(0.0), clock)
    settings = replace(ScanSettings.of(SKIN), singly=singly)
    items = []
    with Link(twin, SCAN, settings, clock=clock.now) as link:
        link.connect()
        if press:
            twin.set_presses((Press(0.01, 0.02, 4.0, 0.01),))
        while sum(isinstance(item, Frame) for item in items) < frames:
            items += link.poll(0.05)
    return items


def of(kind, items):
    return [item for item in items if isinstance(item, kind)]


@pytest.mark.parametrize("press", [False, True])
def test_full_turns_are_the_whole_scans_to_the_bit(press):
    whole = of(Frame, played(False, 12, press=press))
    turns = of(Frame, played(True, 12, press=press))
    for one, other in zip(whole[:12], turns[:12], strict=True):
        assert (one.sequence, one.ticks, one.flags) == (other.sequence, other.ticks, other.flags)
        assert np.array_equal(one.samples, other.samples)


def test_each_drive_comes_at_its_own_end():
    items = played(True, 3)
    drives = of(DriveSamples, items)
    scan_time = of(Frame, items)[1].ticks / SKIN.readout.tick_rate
    steps = np.diff([drive.host_time for drive in drives[:16]])
    assert steps == pytest.approx(np.full(15, scan_time / 8), rel=1e-3)
