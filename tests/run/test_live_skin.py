"""What a control loop reads: the newest contacts, how old they are, and whether to rely on them."""

from __future__ import annotations

import math
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from run.board import Board, samples_of
from run.sinks.conftest import robot_program
from tomoskin import open_skin
from tomoskin.core import DataError, SkinError, SourceError
from tomoskin.learning import FORCE
from tomoskin.pipeline.pipeline import REFERENCE_FRAMES
from tomoskin.run import LiveSkin, Runner, commands, live_skin
from tomoskin.twin import Press

PATIENCE = 300
MOST_LINES = 15
PRESS = Press(0.03, 0.02, force=4.0, radius=0.014)


@pytest.fixture(scope="module")
def force_file(tmp_path_factory):
    """Forces of the twin, learnt from presses that it simulated, as a person would."""
    folder = tmp_path_factory.mktemp("force")
    for words in (
        "simulate --skin textile-disc-8 --presses 40 --seed 1 --processes 1 --out set.npz",
        "calibrate force set.npz --skin textile-disc-8 --out force.npz",
    ):
        command = [sys.executable, "-m", "tomoskin", *words.split()]
        subprocess.run(command, cwd=folder, check=True, capture_output=True)
    return folder / "force.npz"


@pytest.fixture
def board():
    return Board()


@pytest.fixture
def live(prepared, board):
    """A skin whose board sends a frame when the test says so; none has come yet."""
    runner = Runner(prepared, board.open)
    with LiveSkin(runner, max_age=PATIENCE) as skin:
        runner.start()
        assert board.scanning.wait(PATIENCE)
        yield skin


def until(skin, true):
    """The first contacts for which it is true."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        contacts = skin.wait(1.0)
        if true(contacts):
            return contacts
    raise AssertionError(contacts)


def begin(skin, board, prepared):
    """Frames of the untouched skin until its reference stands."""
    samples = samples_of(prepared)
    for number in range(REFERENCE_FRAMES + 5):
        board.send(samples)
        contacts = until(skin, lambda c, n=number: c.sequence == n)
    assert contacts.valid
    return contacts


def test_before_the_first_frame_it_does_not_wait_and_is_not_valid(live):
    contacts = live.latest()
    assert not contacts.valid
    assert contacts.problem
    assert contacts.age_s == math.inf
    assert math.isnan(contacts.force)
    assert contacts.touches == ()


def test_a_slow_loop_gets_the_newest_and_no_backlog(live, board, prepared):
    contacts = begin(live, board, prepared)
    assert math.isnan(contacts.force)  # nothing is known of forces
    for _ in range(7):
        board.send(samples_of(prepared))
    assert until(live, lambda c: c.sequence == contacts.sequence + 7).valid
    before = live.latest().sequence
    assert live.wait(0.05).sequence == before  # there is no other: it returns all the same
    assert live.latest().sequence == before


def test_each_thread_waits_for_what_it_has_not_got(live, board, prepared):
    begin(live, board, prepared)
    got = []
    other = threading.Thread(target=lambda: got.append(live.wait(PATIENCE)))
    other.start()  # it has got none yet, so there is one for it
    other.join(PATIENCE)
    assert got[0].sequence == live.latest().sequence


def test_a_frame_grows_old_and_is_not_valid_any_more(live, board, prepared):
    contacts = begin(live, board, prepared)
    age = contacts.age_s
    assert 0 < age < PATIENCE
    live.max_age = age + 0.2
    assert live.latest().valid
    time.sleep(0.25)
    assert contacts.age_s >= age + 0.25
    old = live.latest()
    assert not old.valid
    assert "s old" in old.problem
    assert old.sequence == contacts.sequence
    assert math.isnan(old.force)


def test_a_lost_board_wakes_who_waits(live, board, prepared):
    begin(live, board, prepared)
    threading.Timer(0.2, board.lose).start()
    begun = time.monotonic()
    lost = live.wait(PATIENCE)
    assert time.monotonic() - begun < PATIENCE / 2
    assert not lost.valid
    assert "disconnected" in lost.problem
    assert lost.touches == ()


def test_what_cannot_run_is_said_before_it_does(tmp_path, force_file):
    with pytest.raises(SkinError, match="expected a skin, got none"):
        open_skin(None, "twin")
    with pytest.raises(SourceError):
        open_skin("textile-disc-8", f"serial:{tmp_path}/none")
    with pytest.raises(DataError, match="give only one of them"):
        open_skin("textile-disc-8", "twin", [force_file, force_file])


def test_a_skin_that_is_closed_is_not_valid_and_an_age_is_a_number(live, board, prepared):
    begin(live, board, prepared)
    assert live.latest().valid
    live.close()
    assert not live.latest().valid
    assert live.latest().problem == "the skin has been closed"
    for wrong in (math.nan, -1.0, 0, "0.5"):
        with pytest.raises(SkinError, match="expected a max_age of more than 0 s"):
            open_skin("textile-disc-8", "twin", max_age=wrong)


def test_one_calibration_needs_no_list(force_file):
    with open_skin("textile-disc-8", "twin", str(force_file)) as skin:
        assert FORCE.name in skin.runner.prepared.calibrations


def test_a_replay_ages_as_if_it_were_now(tmp_path, force_file):
    path = tmp_path / "run.mcap"
    with open_skin("textile-disc-8", "twin", [force_file]) as skin:
        skin.runner.ask(commands.Record(path))
        until(skin, lambda c: c.valid)
    with open_skin(None, f"replay:{path}") as skin:  # with the calibration that it holds
        assert FORCE.name in skin.runner.prepared.calibrations
        contacts = until(skin, lambda c: c.valid)
        assert 0 < contacts.age_s < 1.0
        assert contacts.latency is None
        skin.max_age = 0.01
        assert "ended" in until(skin, lambda c: c.problem and "ended" in c.problem).problem


def test_the_reflex_of_the_documentation_acts_on_newtons(monkeypatch, force_file, tmp_path):
    program = robot_program("robot.md", "tomoskin")
    assert len([line for line in program.splitlines() if line.strip()]) <= MOST_LINES
    open_source, wait, opened, said = live_skin.open_source, LiveSkin.wait, [], []

    def keep(*arguments):
        opened.append(open_source(*arguments))
        return opened[-1]

    def pressed_once_valid(skin, timeout):
        contacts = wait(skin, timeout)
        if contacts.valid and not opened[0].sheet.presses:
            opened[0].set_presses((PRESS,))
        return contacts

    def note(*words):
        said.append(words)
        if words[0] != "hold:":
            raise KeyboardInterrupt  # as a person ends it

    monkeypatch.setattr(live_skin, "open_source", keep)
    monkeypatch.setattr(LiveSkin, "wait", pressed_once_valid)
    monkeypatch.chdir(tmp_path)
    Path("force.npz").write_bytes(force_file.read_bytes())
    with pytest.raises(KeyboardInterrupt):
        exec(compile(program, "robot.md", "exec"), {"print": note})
    assert any(words[0] == "hold:" for words in said)  # until the skin has been measured
    newtons, position, normal = said[-1]
    assert newtons == pytest.approx(PRESS.force, rel=0.6)
    assert position == pytest.approx((PRESS.x, PRESS.y, 0), abs=0.015)
    assert normal == (0, 0, 1)


def test_who_waits_makes_contacts_once_for_all_that_wakes_it(live, board, prepared, monkeypatch):
    begin(live, board, prepared)
    made, contacts_of = [], Runner.contacts_of
    monkeypatch.setattr(
        Runner, "contacts_of", lambda run, news: made.append(news) or contacts_of(run, news)
    )
    woken = [threading.Timer(0.02 * number, live.runner.audience.wake) for number in range(1, 6)]
    for timer in woken:
        timer.start()
    live.wait(0.3)
    assert len(made) == 1
