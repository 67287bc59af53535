"""A replay as a page steers it, and notes on a run."""

from __future__ import annotations

import json
import math
import time
from contextlib import contextmanager

import pytest

from run.board import Board
from run.test_replay import run, same, touches_of  # the recorded run
from run.test_runner import PATIENCE, Watch
from server.serving import Site
from tomoskin.core import DataError, Mark
from tomoskin.files.session import SessionReader, read_timeline, replayed
from tomoskin.files.session.replay import open_replay
from tomoskin.files.session.session_reader import end_time
from tomoskin.run import Runner, commands

__all__ = ["run"]


class Page:
    """A page's connection: asks, and waits for messages."""

    def __init__(self, socket):
        self._socket = socket

    def ask(self, kind, /, **fields):
        self._socket.send(json.dumps({"type": kind} | fields))

    def told(self, kind, true=lambda _: True):
        """The next message of that kind for which ``true`` holds."""
        end = time.monotonic() + PATIENCE
        seen = None
        while time.monotonic() < end:
            message = self._socket.recv(PATIENCE)
            if isinstance(message, str):
                found = json.loads(message)
                if found["type"] == kind and true(found):
                    return found
                seen = found if found["type"] in (kind, "error") else seen
        raise AssertionError(f"no such {kind}; the last: {seen}")


@contextmanager
def page_of(runner):
    runner.start()
    site = Site(runner)
    try:
        with site.connect() as socket:
            yield Page(socket)
    finally:
        site.stop()
        runner.stop()


@pytest.fixture
def replay(run, prepared):
    """(runner, page) of a replay that stands still at its first frame."""
    transport = open_replay(f"{run}@1", prepared.skin)
    transport.pause(True)
    runner = Runner(prepared, lambda: transport)
    with page_of(runner) as page:
        yield runner, page


def frames(run):
    with SessionReader(run) as session:
        return [item.frame for item in session.frames()]


def test_a_page_goes_about_in_a_replay(run, replay):
    runner, page = replay
    until = Watch(runner).until
    all_frames = frames(run)
    start = all_frames[0].host_time
    told = page.told("state")["replay"]
    assert (told["now_s"], told["speed"], told["loop"], told["ended"]) == (0, 1, False, False)
    with SessionReader(run) as session:
        assert told["end_s"] == pytest.approx(end_time(session) - start)
    assert told["end_s"] > all_frames[-1].host_time - start - 1e-6  # times are rounded to 1 ns

    page.ask("seek", at_s=all_frames[28].host_time - start)
    until(lambda: runner.newest and runner.newest.result.sequence == 28)
    page.ask("step")
    until(lambda: runner.newest.result.sequence == 29)
    page.ask("speed", speed=None)
    page.ask("loop", on=True)
    page.told("state", lambda s: s["replay"]["speed"] is None and s["replay"]["loop"])
    page.ask("pause", on=False)
    until(lambda: runner.newest.result.sequence < 28)  # past the end and on
    told = page.told("state", lambda s: s["reference"]["age_s"] is not None)
    span = all_frames[-1].host_time - start
    assert 0 <= told["p50_ms"] < 1e3 * PATIENCE  # of this run, not since the recording
    assert 0 <= told["reference"]["age_s"] <= span
    page.ask("loop", on=False)
    assert page.told("state", lambda s: s["replay"]["ended"])["replay"]["speed"] is None
    page.ask("speed", speed=0.5)
    page.told("state", lambda s: s["replay"]["speed"] == 0.5)


@pytest.mark.parametrize("number", [30, 45, 59])
def test_after_a_jump_the_pictures_are_those_of_the_run(run, prepared, replay, number):
    """30 stands on the first reference, the others on the second; places are those of the run."""
    runner, page = replay
    with SessionReader(run) as session:
        live = {result.sequence: result for result in replayed(prepared, session)}
    start = frames(run)[0].host_time
    page.ask("seek", at_s=frames(run)[number].host_time - start)
    Watch(runner).until(lambda: runner.newest and runner.newest.result.sequence == number)
    got, expected = runner.newest.result, live[number]
    assert got.ready == expected.ready
    assert same(got.reference.tolist(), expected.reference.tolist())
    assert same(got.voltages.tolist(), expected.voltages.tolist())


def test_the_time_line(run, replay):
    _, page = replay
    told = page.told("timeline")
    with SessionReader(run) as session:
        start = next(session.frames()).frame.host_time
        held = [(item.host_time - start, touches_of(item)) for item in session.touches()]
    ids = {row[0] for _, rows in held for row in rows}
    assert {span["id"] for span in told["touches"]} == ids
    first = told["touches"][0]
    times = [time for time, rows in held if any(row[0] == first["id"] for row in rows)]
    assert (first["begin"], first["end"]) == (times[0], times[-1])
    assert "connected" in [event["kind"] for event in told["events"]]
    assert told["notes"] == []


def test_a_timeline_of_no_session(tmp_path):
    with pytest.raises(DataError):
        read_timeline(tmp_path / "none.mcap")


def test_only_a_replay_can_be_steered(prepared, idle):
    runner = Runner(prepared, lambda: Board(free=idle))
    with page_of(runner) as page:
        assert page.told("state")["replay"] is None
        for kind, asked in (("seek", {"at_s": 1}), ("step", {}), ("loop", {"on": True})):
            page.ask(kind, **asked)
            assert "is not a replay" in page.told("error")["message"]


def test_a_note_is_told_and_recorded_at_the_picture_that_was_shown(prepared, idle, tmp_path):
    runner = Runner(prepared, lambda: Board(free=idle))
    path = tmp_path / "noted.mcap"
    runner.ask(commands.Record(path))
    with page_of(runner) as page:
        Watch(runner).until(lambda: runner.newest and runner.newest.result.ready)
        page.ask("note", text="a wet cloth")
        told = page.told("event", lambda e: e["kind"] == "note")
        assert told["text"] == "a wet cloth"
    with SessionReader(path) as session:
        (note,) = session.notes()
        times = {item.frame.host_time for item in session.frames()}
        assert "note" not in {event.kind for event in session.events()}
    assert (note.text, note.host_time) == ("a wet cloth", told["time_s"])
    assert note.host_time in times
    found = read_timeline(path)
    assert [event.text for _, event in found.notes] == ["a wet cloth"]


def test_a_jump_begins_with_the_frames_of_its_reference(run):
    from tomoskin.files.session.info import References

    found = References(run, {"reference_frames": 2})
    all_frames = frames(run)
    made_of = found.before(all_frames[28].host_time)
    assert [item.frame.sequence for item in made_of] == [0, 1, 2, 3, 4, 5]
    assert all(item.mark & Mark.EARLIER for item in made_of)
    assert made_of[0].mark & Mark.REFERENCE
    assert [i.frame.sequence for i in found.before(all_frames[36].host_time)] == [33, 34, 35]
    assert found.before(all_frames[0].host_time) == ()
    assert len(found.before(math.inf)) == 6
