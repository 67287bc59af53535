"""A recording of a board that sent its drives one by one, played again."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from files.session.runs import same_frame
from tomoskin.board.source import Link, ScanSettings
from tomoskin.core import DriveSamples, Frame, Mark, VirtualClock
from tomoskin.files.session import SessionReader, SessionWriter
from tomoskin.files.session.replay import ReplayTransport
from tomoskin.model.pattern import Scan
from tomoskin.model.skin import Skin
from tomoskin.twin import TwinSettings, make_twin

SKIN = Skin.load("textile-disc-8")
SINGLY = replace(ScanSettings.of(SKIN), singly=True)
SCAN = Scan.of(SKIN.pattern())


def of(kind, items):
    return [item for item in items if isinstance(item, kind)]


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """A session whose board sends each drive; its frames, and its drives."""
    path = tmp_path_factory.mktemp("drives") / "drives.mcap"
    clock = VirtualClock()
    twin = make_twin(SKIN, TwinSettings.preset(SKIN.twin.preset, 3), clock)
    items = []
    with (
        SessionWriter(path, SKIN) as writer,
        Link(twin, SCAN, SINGLY, clock=clock.now, tap=writer.raw) as link,
    ):
        link.connect()
        for _ in range(120):
            read = link.poll(0.05)
            items += read
            for frame in of(Frame, read):
                writer.frame(frame, Mark.NONE)
    return path, items


def replayed(path, settings, since=None):
    session = SessionReader(path)
    transport = ReplayTransport(session, SKIN, speed=float("inf"), clock=VirtualClock())
    items = []
    with Link(transport, SCAN, settings) as link:
        if since is not None:
            transport.seek(since)
        while not transport.ended:
            items += link.poll(0.05)
    return items


def test_a_replay_makes_the_frames_that_were_recorded(recorded):
    path, items = recorded
    played = replayed(path, ScanSettings.of(SKIN))
    assert of(DriveSamples, played) == []
    frames = of(Frame, items)
    assert len(frames) >= 8
    assert len(of(Frame, played)) == len(frames)
    assert all(map(same_frame, frames, of(Frame, played)))


def test_a_replay_has_the_drives_where_they_are_asked_for(recorded):
    path, items = recorded
    played = replayed(path, SINGLY)
    kept = [item for item in items if isinstance(item, DriveSamples | Frame)]
    again = [item for item in played if isinstance(item, DriveSamples | Frame)]
    assert [type(item) for item in again] == [type(item) for item in kept]
    assert {drive.order for drive in of(DriveSamples, again)} == {0}
    for one, other in zip(of(DriveSamples, kept), of(DriveSamples, again), strict=True):
        assert np.array_equal(one.samples, other.samples)
        assert (one.ticks, one.order, one.place) == (other.ticks, other.order, other.place)
        # what the first frame is made of is played at once
        assert one.host_time == other.host_time or one.sequence == 0


def test_a_seek_goes_to_the_first_byte_of_a_frames_first_drive(recorded):
    path, items = recorded
    frames = of(Frame, items)
    later = of(Frame, replayed(path, ScanSettings.of(SKIN), since=frames[3].host_time))
    assert len(later) == len(frames) - 3
    assert all(map(same_frame, frames[3:], later))
