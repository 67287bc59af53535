"""A recorded run, played again: the same touches to the bit, and the ways about in it."""

from __future__ import annotations

import math
import threading

import numpy as np
import pytest

from run.board import Board, pressed, samples_of
from run.test_runner import PATIENCE, Watch
from tomoskin.board.source import Link, ScanSettings
from tomoskin.core import DataError, Frame, Mark, SourceError
from tomoskin.files.session import SessionReader, replayed
from tomoskin.files.session.replay import ReplayTransport, open_replay, parse_replay
from tomoskin.model.skin import Skin
from tomoskin.pipeline import Pipeline, prepare
from tomoskin.pipeline.pipeline import REFERENCE_FRAMES
from tomoskin.run import Runner, commands
from tomoskin.run.intake import MOST_AT_ONCE


def noisy(samples, number):
    """The same noise for the same number, some counts wide."""
    rng = np.random.default_rng(number)
    return (samples + rng.integers(-3, 4, len(samples))).astype("<u2")


class Recorded:
    """A live run on a board of the test's own, recorded from its beginning."""

    def __init__(self, prepared, path):
        self.path, self.board = path, Board()
        self.board.tick = 800_000  # 50 ms a frame: a pause after a touch has ten of them
        self._idle, self._drift = samples_of(prepared), 0
        self._places = [samples_of(prepared, pressed(prepared, x, 0.01)) for x in (-0.03, 0.03)]
        self.runner = Runner(prepared, lambda: self.board)
        self.until = Watch(self.runner).until
        self.sent = 0

    def __enter__(self):
        self.runner.ask(commands.Record(self.path))
        self.runner.start()
        assert self.board.scanning.wait(PATIENCE)
        return self

    def __exit__(self, *_):
        self.runner.stop()

    def idle(self, count):
        self._send([self._idle] * count)

    def touch(self, place, count):
        self._send([self._places[place]] * count)

    def drift(self, counts):
        """Every other sample reads so much more from here on."""
        self._drift = counts

    def _send(self, frames):
        for samples in frames:
            drift = self._drift * (np.arange(len(samples)) % 2)
            self.board.send(noisy(samples + drift, self.sent))
            self.sent += 1
            self.until(
                lambda: self.runner.status().frames >= self.sent or self.runner.status().paused
            )


@pytest.fixture(scope="module")
def run(prepared, tmp_path_factory):
    """Reference, two touches, a new reference under the second one, a lost frame, a burst."""
    path = tmp_path_factory.mktemp("run") / "run.mcap"
    with Recorded(prepared, path) as live:
        live.idle(REFERENCE_FRAMES + 5)
        live.touch(0, 8)
        live.runner.ask(commands.TakeReference())
        live.touch(1, REFERENCE_FRAMES + 4)
        live.idle(6)
        live.board.raw(b"\x05torn")
        live.board.raw(b"\0")
        with live.board._news:  # more at once than are processed
            for _ in range(MOST_AT_ONCE + 5):
                live.board.send(noisy(live._places[0], live.sent))
        last = 2 * REFERENCE_FRAMES + 5 + 8 + 4 + 6 + MOST_AT_ONCE + 5 - 1
        live.until(lambda: live.runner.newest.result.sequence == last)
    return path


def touches_of(result):
    """Everything but the cells of the touches of a result, or of a row of the file."""
    return [
        (
            t.id,
            t.kind,
            t.since,
            t.merged,
            r.x,
            r.y,
            r.sd_x,
            r.sd_y,
            r.cov_xy,
            r.area,
            r.peak,
            r.close,
            r.force,
            r.depth,
        )
        for t in result.touches
        for r in [t.detection]
    ]


def recorded_touches(path):
    with SessionReader(path) as session:
        return {item.sequence: touches_of(item) for item in session.touches()}


def test_what_happens_to_touches_is_recorded_and_happens_again(run, prepared):
    with SessionReader(run) as session:
        told = [(e.host_time, e.kind, e.text) for e in session.events() if "touch-" in e.kind]
        again = [
            (e.host_time, f"touch-{e.kind}", e.text)
            for result in replayed(prepared, session)
            for e in result.events
        ]
    assert [kind for _, kind, _ in told if kind != "touch-move"][:3] == [
        *("touch-onset", "touch-release", "touch-onset")
    ]
    assert told == again


def same(a, b):
    """To the last bit: NaN is the same as NaN."""
    return repr(a) == repr(b)


def test_the_run_is_worth_replaying(run):
    with SessionReader(run) as session:
        marks = [item.mark for item in session.frames()]
    assert marks[0] == Mark.REFERENCE | Mark.OPENED
    assert sum(mark == Mark.REFERENCE for mark in marks) == 1
    assert sum(mark == Mark.SKIPPED for mark in marks) == 5
    found = recorded_touches(run)
    assert len(found) > 20
    assert len({(number, since) for rows in found.values() for number, _, since, *_ in rows}) > 1


def test_replayed_without_a_clock_the_touches_are_the_same_to_the_bit(run, prepared):
    with SessionReader(run) as session:
        got = {r.sequence: touches_of(r) for r in replayed(prepared, session) if r.ready}
    live = recorded_touches(run)
    assert {n for n, rows in got.items() if rows} == {n for n, rows in live.items() if rows}
    assert all(same(got[n], rows) for n, rows in live.items())


def test_the_skin_in_the_file_gives_the_same_touches(run):
    from tomoskin.pipeline import prepare

    with SessionReader(run) as session:
        got = {r.sequence: touches_of(r) for r in replayed(prepare(session.skin), session)}
    assert all(same(got[n], rows) for n, rows in recorded_touches(run).items())


def test_replayed_as_a_source_the_touches_are_the_same_to_the_bit(run, prepared, tmp_path):
    """Through link, decoder and runner at full speed, and recorded again."""
    again = tmp_path / "again.mcap"
    transports = []

    def reopen():
        transports.append(open_replay(f"{run}@max", prepared.skin))
        return transports[-1]

    runner = Runner(prepared, reopen)
    runner.ask(commands.Record(again))
    until = Watch(runner).until
    runner.start()
    until(lambda: runner.status().replay.ended)
    status = runner.status()
    runner.stop()
    live, got = recorded_touches(run), recorded_touches(again)
    assert set(live) == set(got)
    assert all(same(got[n], rows) for n, rows in live.items())
    assert status.corrupt == 1
    assert status.gaps == 0


@pytest.fixture
def open_at(run, prepared):
    """A replay and the link to it."""
    opened = []

    def open_at(argument=""):
        transport = open_replay(f"{run}{argument}", prepared.skin)
        link = Link(transport, prepared.scan, ScanSettings.of(prepared.skin))
        link.connect()
        opened.append(link)
        return transport, link

    yield open_at
    for link in opened:
        link.close()


def frames_of(link, count):
    found = []
    while len(found) < count:
        found += [item for item in link.poll(0.01) if isinstance(item, Frame)]
    return found


def test_seek_begins_with_the_first_frame_there(run, open_at):
    with SessionReader(run) as session:
        times = [item.frame.host_time for item in session.frames()]
    transport, link = open_at("@max")
    new = REFERENCE_FRAMES + 5 + 8  # the second reference begins here
    for number in (40, 3, 17):
        transport.seek(times[number])
        first = new if number > new else 0
        found = frames_of(link, number - first + 1)
        assert [frame.sequence for frame in found] == list(range(first, number + 1))
        assert [frame.host_time for frame in found] == times[first : number + 1]
        assert transport.now() >= times[number]
    assert link.frames.lost == 0
    assert link.counters.corrupt == 0


def test_beyond_the_end_it_waits(open_at):
    transport, link = open_at("@max")
    transport.seek(1e9)
    assert transport.ended
    assert link.poll(0.0) == []
    transport.seek(-math.inf)
    assert frames_of(link, 1)[0].sequence == 0


def test_pause_and_step(open_at):
    transport, link = open_at("@max")
    frames_of(link, 3)
    transport.pause(True)
    here = transport.now()
    assert link.poll(0.0) == []
    assert transport.now() == here
    transport.step()
    [frame] = frames_of(link, 1)
    assert frame.host_time > here
    assert link.poll(0.0) == []
    transport.pause(False)
    assert frames_of(link, 1)[0].sequence == frame.sequence + 1


def test_loop_begins_again_with_the_reference(run, open_at):
    with SessionReader(run) as session:
        count = sum(1 for _ in session.frames())
    _, link = open_at("@max,loop")
    sequences = [frame.sequence for frame in frames_of(link, 2 * count + 1)]
    assert sequences[: 2 * count : count] == [0, 0]
    assert sequences[:count] == sequences[count : 2 * count]


class Script:
    """A clock that goes on only when something waits for it."""

    def __init__(self):
        self.time = 100.0

    def now(self):
        return self.time

    def wait(self, condition, seconds):
        del condition
        self.time += seconds


@pytest.mark.parametrize("speed", [0.5, 1.0, 4.0])
def test_it_keeps_the_recordings_time(run, prepared, speed):
    clock = Script()
    with SessionReader(run) as session:
        times = [item.frame.host_time for item in session.frames()]
    transport = ReplayTransport(SessionReader(run), prepared.skin, speed=speed, clock=clock)
    link = Link(transport, prepared.scan, ScanSettings.of(prepared.skin))
    link.connect()
    start = clock.time
    frames_of(link, 1)
    for time in times[1:]:
        before = clock.time
        [frame] = frames_of(link, 1)
        if frame.sequence > 60:
            break
        assert frame.host_time == time
        assert clock.time - start == pytest.approx((time - times[0]) / speed, abs=1e-6)
        assert clock.time >= before
    link.close()


def test_a_recording_begun_later_has_the_reference(prepared, tmp_path):
    path = tmp_path / "later.mcap"
    with Recorded(prepared, tmp_path / "whole.mcap") as live:
        live.idle(REFERENCE_FRAMES + 5)
        live.runner.ask(commands.Record(path))
        live.touch(0, 8)
    with SessionReader(path) as session:
        early = [item for item in session.frames() if item.mark & Mark.EARLIER]
        results = list(replayed(prepared, session))
    assert len(early) == REFERENCE_FRAMES + 5
    assert [r.sequence for r in results] == list(range(REFERENCE_FRAMES + 5, live.sent))
    assert all(r.ready for r in results)
    whole = recorded_touches(tmp_path / "whole.mcap")
    assert not whole  # that recording had ended when the touch came
    positions = {
        n: [(x, y) for _, _, _, _, x, y, *_ in rows] for n, rows in recorded_touches(path).items()
    }
    got = {r.sequence: [(t.detection.x, t.detection.y) for t in r.touches] for r in results}
    assert positions
    assert all(got[n] == rows for n, rows in positions.items())


def late(live, path):
    """Touches and drift, long after the reference; recorded from ``path`` on, under a touch."""
    drift = 0
    for _ in range(3):
        live.idle(30)
        drift += 2
        live.drift(drift)
        live.idle(30)
        live.touch(0, 6)
        live.idle(20)
    live.touch(1, 4)
    live.runner.ask(commands.Record(path))
    live.touch(1, 6)
    live.idle(25)
    live.drift(drift + 2)
    live.touch(0, 8)
    live.idle(25)
    live.touch(1, 8)


@pytest.mark.parametrize("method", ["image", "fit"])
def test_a_recording_begun_late_is_replayed_to_the_bit(tmp_path, method):
    """Though the pipeline had long followed the drift, and had seen four touches."""
    settings = {"touch": {"method": method}, "inverse": {"alpha": "auto"}}
    prepared = prepare(Skin.load("textile-disc-8").altered(settings))
    path = tmp_path / "later.mcap"
    with Recorded(prepared, tmp_path / "whole.mcap") as live:
        live.idle(REFERENCE_FRAMES)
        late(live, path)
    recorded = recorded_touches(path)
    with SessionReader(path) as session:
        frames = list(session.frames())
        early = [item for item in frames if item.mark & Mark.EARLIER]
        results = list(replayed(prepared, session))
    assert len(early) == 3 * REFERENCE_FRAMES
    with SessionReader(tmp_path / "whole.mcap") as session:
        begun = [item.frame.host_time for item in session.frames()][4 * REFERENCE_FRAMES]
    assert early[0].frame.host_time > begun
    assert all(result.ready for result in results)
    got = {r.sequence: touches_of(r) for r in results}
    assert {n: rows for n, rows in got.items() if rows or n in recorded} == recorded
    before, after = (
        {row[0] for rows in touches.values() for row in rows}
        for touches in (recorded_touches(tmp_path / "whole.mcap"), recorded)
    )
    assert len(before) >= 3
    assert sorted(after) == [max(before) + n for n in (1, 2, 3)]
    with SessionReader(path) as session:
        transport = ReplayTransport(session, prepared.skin, speed=math.inf)
        runner = Runner(prepared, lambda: transport)
        until = Watch(runner).until
        runner.ask(commands.Record(tmp_path / "again.mcap"))
        runner.start()
        # not by its number: a pause of a busy machine is one in the replay, which begins anew
        until(lambda: runner.status().frames == len(frames))
        runner.stop()
    assert recorded_touches(tmp_path / "again.mcap") == recorded


def test_two_recordings_begun_late_one_after_the_other(prepared, tmp_path):
    """Each as the run is then: the second begins under a touch."""
    first, second = tmp_path / "first.mcap", tmp_path / "second.mcap"
    with Recorded(prepared, tmp_path / "whole.mcap") as live:
        live.idle(4 * REFERENCE_FRAMES)
        live.runner.ask(commands.Record(first))
        live.touch(0, 6)
        live.runner.ask(commands.Record(second))
        live.touch(0, 6)
    for path in (first, second):
        with SessionReader(path) as session:
            got = {r.sequence: touches_of(r) for r in replayed(prepared, session)}
        recorded = recorded_touches(path)  # it may end before the last frame's touches are known
        assert any(recorded.values())
        assert all(got[n] == rows for n, rows in recorded.items())


def test_a_held_picture_is_held_in_the_replay_too(prepared, tmp_path):
    path = tmp_path / "held.mcap"
    with Recorded(prepared, path) as live:
        live.idle(REFERENCE_FRAMES + 2)
        live.runner.ask(commands.SetPause(True))
        live.touch(0, 3)
        while live.runner.status().frames < live.sent:  # a held picture announces nothing
            threading.Event().wait(0.001)
        live.runner.ask(commands.SetPause(False))
        live.touch(0, 3)
    with SessionReader(path) as session:
        marks = {item.frame.sequence: item.mark for item in session.frames()}
        got = [r.sequence for r in replayed(prepared, session)]
    held = [n for n, mark in marks.items() if mark & Mark.HELD]
    assert held
    assert set(got) == set(marks) - set(held)


def test_another_skin_is_refused(run):
    with pytest.raises(SourceError, match=r"recorded with another scan .* \(leave out --skin"):
        open_replay(str(run), Skin.load("textile-disc-16"))


@pytest.mark.parametrize(
    ("rest", "speed", "loop"),
    [("", 1, False), (",loop", 1, True), ("@2", 2, False), ("@2,loop", 2, True)],
)
@pytest.mark.parametrize("name", ["run.mcap", "a@2,loop.mcap", "a,b@lab.mcap"])
def test_what_stands_behind_a_file(tmp_path, name, rest, speed, loop):
    file = tmp_path / name
    file.touch()
    assert parse_replay(f"{file}{rest}") == (file, speed, loop)


@pytest.mark.parametrize("speed", ["@0", "@-1", "@fast", "@nan", "@1,twice", "@", ",twice"])
def test_an_impossible_speed_is_refused(run, prepared, speed):
    with pytest.raises((SourceError, DataError), match=r"expected @SPEED|no such file"):
        open_replay(f"{run}{speed}", prepared.skin)


def test_a_session_without_frames_is_refused(tmp_path, prepared):
    from tomoskin.files.session import SessionWriter

    with SessionWriter(tmp_path / "x.mcap", prepared.skin):
        pass
    with pytest.raises(SourceError, match="holds no frame"):
        open_replay(str(tmp_path / "x.mcap"), prepared.skin)


def test_frames_alone_are_enough(run, prepared, tmp_path):
    """A session without raw bytes, and of a scan that is set otherwise today."""
    from dataclasses import replace

    from tomoskin.files.session import SessionWriter

    bare = tmp_path / "bare.mcap"
    with SessionReader(run) as session, SessionWriter(bare, prepared.skin) as copy:
        expected = [item.frame for item in session.frames()]
        for frame in expected:
            copy.frame(replace(frame, configuration=0x5555))
    transport = open_replay(f"{bare}@max", prepared.skin)
    with Link(transport, prepared.scan, ScanSettings.of(prepared.skin)) as link:
        link.connect()
        got = frames_of(link, len(expected))
    assert all(np.array_equal(a.samples, b.samples) for a, b in zip(got, expected, strict=True))
    assert [f.host_time for f in got] == [f.host_time for f in expected]


def test_pausing_the_runner_of_a_replay_stops_the_replay(run, prepared):
    transports = []

    def reopen():
        transports.append(open_replay(f"{run}@max,loop", prepared.skin))
        return transports[-1]

    runner = Runner(prepared, reopen)
    until = Watch(runner).until
    runner.start()
    until(lambda: runner.newest)
    runner.ask(commands.SetPause(True))
    assert transports[0].paused
    assert runner.status().paused
    runner.ask(commands.SetPause(False))
    assert not transports[0].paused
    runner.stop()


def test_advance_gives_no_picture_of_a_skipped_frame(run, prepared):
    with SessionReader(run) as session:
        frame = next(session.frames()).frame
    pipeline = Pipeline(prepared)
    assert pipeline.push(frame, Mark.SKIPPED) is None
    assert pipeline.push(frame, Mark.HELD) is None
    assert pipeline.reference_state.frames == 0
    assert pipeline.push(frame, Mark.NONE) is not None
