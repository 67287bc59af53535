"""Settings that are changed while the skin is live."""

from __future__ import annotations

import asyncio
import contextlib
import threading

import msgspec
import numpy as np
import pytest

from run.board import Board
from run.test_runner import PATIENCE, Watch
from tomoskin.core import PatternError, reach
from tomoskin.core.user_files import MAGIC
from tomoskin.files.session import SessionReader, replayed
from tomoskin.model.pattern import named
from tomoskin.pipeline import prepare
from tomoskin.run import Runner, commands
from tomoskin.server import Hub
from tomoskin.server.requests import decode_request
from tomoskin.server.settings_handlers import STAGES, SettingsHandlers
from tomoskin.server.settings_messages import table_of

CHANGES = {
    "alpha": {"inverse": {"alpha": 0.05}},
    "prior": {"inverse": {"prior": "laplace"}},
    "difference": {"inverse": {"difference": "normalised"}},
    "threshold": {"touch": {"gamma1": 0.8}},
    "mesh": {"mesh": {"cells": 600}},
}


@pytest.mark.parametrize("change", CHANGES.values(), ids=CHANGES)
def test_prepared_again_is_prepared(prepared, change):
    skin = prepared.skin.altered(change)
    again, anew = prepare(skin, prepared), prepare(skin)
    np.testing.assert_allclose(again.operator.matrix, anew.operator.matrix, rtol=1e-9)
    assert again.choice.alpha == pytest.approx(anew.choice.alpha)
    assert again.skin is skin
    assert again.segmenter.settings == anew.segmenter.settings
    assert (again.model is prepared.model) == ("mesh" not in change)


class Heard:
    """A page that keeps what it is told."""

    def __init__(self):
        self.told = []
        self._news = None

    def wake(self):
        pass

    def post(self, text):
        self.told.append(msgspec.json.decode(text))
        if self._news and not self._news.done():
            self._news.set_result(None)

    async def until(self, true):
        """Wait, without taking time from the threads that answer."""
        while not true():
            self._news = asyncio.get_running_loop().create_future()
            await self._news

    def last(self, kind):
        return next((m for m in reversed(self.told) if m["type"] == kind), None)


class Unpressable:
    """A board as on a cable."""

    def __init__(self, board):
        self.name = "board on a cable"
        self.read, self.write, self.close = board.read, board.write, board.close
        self._board = board

    @property
    def closed(self):
        return self._board.closed


class Office:
    """A hub with a settings desk and one page, in an event loop of the test's own."""

    def __init__(self, runner, folder):
        self.runner, self.page = runner, Heard()
        self.hub = Hub(runner, folder)
        SettingsHandlers(self.hub)

    def ask(self, *requests):
        """Make requests one after the other, each when the one before is done."""
        asyncio.run(self._ask(requests))

    async def _ask(self, requests):
        async with self.hub.running():
            self.hub.join(self.page)
            for request in requests:
                self.hub.obey(self.page, decode_request(msgspec.json.encode(request)))
                await self.page.until(lambda: not self.page.last("settings")["busy"])
            self.hub.leave(self.page)


@pytest.fixture
def office(runner, tmp_path):
    runner.start()
    Watch(runner).until(lambda: runner.newest and runner.newest.result.ready)
    return Office(runner, tmp_path)


def settings(**keys):
    return {"type": "settings", "changes": keys}


def adopted(office, **expected):
    """Wait until the runner has taken over settings with these inverse values."""

    def same():
        now = office.runner.prepared.skin.inverse
        return all(getattr(now, key) == value for key, value in expected.items())

    Watch(office.runner).until(same)


def test_alpha_changes_and_the_reference_stands(office):
    since = office.runner.status().reference_age
    office.ask(settings(inverse={"alpha": 0.2}))
    adopted(office, alpha=0.2)
    assert office.runner.status().choice.rule == "hand"
    assert office.runner.status().reference_age >= since
    told = office.page.last("settings")
    assert told["document"]["inverse"]["alpha"] == 0.2
    assert told["automatic_alpha"] > 0
    assert office.page.last("scale")["limit"] > 0


def test_undo_and_redo(office):
    office.ask(settings(touch={"gamma1": 0.7}), settings(inverse={"alpha": 0.3}), {"type": "undo"})
    adopted(office, alpha="auto")
    assert office.runner.prepared.skin.touch.gamma1 == 0.7
    office.ask({"type": "undo"}, {"type": "redo"}, {"type": "redo"}, {"type": "redo"})
    adopted(office, alpha=0.3)
    assert office.page.last("settings")["redo"] == 0


@pytest.mark.parametrize(
    ("changes", "section", "key", "words"),
    [
        ({"touch": {"gamma1": 2}}, "touch", "gamma1", "expected a number from 0.1 to 0.99, got 2"),
        ({"inverse": {"alpha": "much"}}, "inverse", "alpha", 'got "much"'),
        ({"outline": {"shape": "rectangle"}}, "outline", "width", "is missing"),
        ({"surface": {"file": "/etc/passwd"}}, "surface", "file", "cannot be changed on the page"),
        ({"drive": {"pattern": "skip:99"}}, "drive", None, "expected k from 0 to 6"),
        ({"mesh": {"cells": 600}}, None, None, "cannot change its sheet"),
        ({"colour": {"hue": 1}}, None, None, "unknown section"),
    ],
)
def test_a_setting_that_cannot_be_is_refused_in_words(office, changes, section, key, words):
    before = office.runner.prepared
    office.ask(settings(**changes))
    told = office.page.last("settings_error")
    assert (told["section"], told["key"]) == (section, key)
    assert words in told["message"]
    assert office.runner.prepared is before


def test_another_sheet_opens_a_simulated_source_anew_while_the_old_one_goes_on(office, board, idle):
    opened, closed = [], []

    def opener(skin):
        opened.append(skin)
        closed.append(board.closed)
        return Board(free=idle)

    office.hub.opener = opener
    office.ask(settings(material={"sheet_resistance": "2 ohm/sq"}))
    assert opened == [office.runner.prepared.skin]
    assert closed == [False]
    assert board.closed
    told = [m for m in office.page.told if m["type"] == "progress" and m["stage"]]
    assert list(dict.fromkeys(m["stage"] for m in told)) == list(STAGES)
    assert [m["done"] for m in told] == sorted(m["done"] for m in told)
    assert office.runner.prepared.skin.conductivity == pytest.approx(0.5)
    assert office.page.last("scene") is not None


def test_a_port_is_let_go_before_it_is_opened_again(prepared, idle, tmp_path):
    boards, closed = [], []

    def opener(_skin):
        closed.extend(board.closed for board in boards)
        boards.append(Unpressable(Board(free=idle)))
        return boards[-1]

    runner = Runner(prepared, lambda: opener(prepared.skin))
    runner.start()
    Watch(runner).until(lambda: runner.newest and runner.newest.result.ready)
    office = Office(runner, tmp_path)
    office.hub.opener = opener
    office.ask(settings(material={"sheet_resistance": "2 ohm/sq"}))
    runner.stop()
    assert closed == [True]


def test_a_newer_change_ends_an_older_one(office, monkeypatch):
    begun, ended, first = [], [], threading.Event()

    def prepare_endlessly(skin, previous):
        if skin.inverse.alpha != 0.5:
            return prepare(skin, previous)
        begun.append(skin)
        first.set()
        try:
            while True:
                reach()
        finally:
            ended.append(skin)

    async def ask():
        async with office.hub.running():
            office.hub.join(office.page)
            for alpha in (0.5, 0.3):
                change = settings(inverse={"alpha": alpha})
                office.hub.obey(office.page, decode_request(msgspec.json.encode(change)))
                assert await asyncio.to_thread(first.wait, PATIENCE)
            await office.page.until(lambda: not office.page.last("settings")["busy"])

    monkeypatch.setattr("tomoskin.server.settings_handlers.prepare", prepare_endlessly)
    asyncio.run(asyncio.wait_for(ask(), PATIENCE))
    assert len(begun) == len(ended) == 1
    adopted(office, alpha=0.3)
    assert office.page.last("settings_error") is None


def test_what_nobody_expected_is_refused_and_the_next_change_is_made(office, monkeypatch):
    def fail(_skin, _previous):
        raise ZeroDivisionError("by zero")

    with monkeypatch.context() as broken:
        broken.setattr("tomoskin.server.settings_handlers.prepare", fail)
        office.ask(settings(inverse={"alpha": 0.2}))
    assert "ZeroDivisionError: by zero" in office.page.last("settings_error")["message"]
    office.ask(settings(inverse={"alpha": 0.3}))
    adopted(office, alpha=0.3)


def test_saved_and_loaded(office, tmp_path):
    save = {"type": "save_skin", "name": "mine"}
    office.ask(settings(inverse={"alpha": 0.2}), save, settings(inverse={"alpha": 0.4}), save)
    adopted(office, alpha=0.4)
    assert "alpha = 0.2" in (tmp_path / "mine.toml").read_text()
    assert "exists" in office.page.last("settings_error")["message"]
    office.ask({"type": "load_skin", "name": "mine"})
    adopted(office, alpha=0.2)
    office.ask(settings(inverse={"alpha": 0.5}), {**save, "replace": True})
    adopted(office, alpha=0.5)
    assert "alpha = 0.5" in (tmp_path / "mine.toml").read_text()


def test_saving_replaces_neither_a_recording_nor_what_a_link_leads_to(office, tmp_path):
    beyond = tmp_path.parent / f"{tmp_path.name}-beyond.toml"
    beyond.write_text("mine")
    (tmp_path / "link.toml").symlink_to(beyond)
    (tmp_path / "run.toml").write_bytes(MAGIC)
    for name, said in (("link", "is a link"), ("run", "a recording is never overwritten")):
        office.ask({"type": "save_skin", "name": name, "replace": True})
        message = office.page.last("settings_error")["message"]
        assert said in message
        assert message.startswith(f"{name}.toml: ")
    assert beyond.read_text() == "mine"
    assert (tmp_path / "run.toml").read_bytes() == MAGIC


@pytest.mark.parametrize("name", ["../evil", "/etc/passwd", ".hidden", "a.b", "", "a" * 65, "a\n"])
def test_names_stay_in_the_folder(name):
    for kind in ("save_skin", "load_skin"):
        with pytest.raises(Exception, match="not understood"):
            decode_request(msgspec.json.encode({"type": kind, "name": name}))


def test_a_recording_ends_and_what_it_holds_replays_to_the_bit(prepared, board, tmp_path):
    seen = {}

    def see():
        if runner.newest is not None:  # that the board runs is news too
            seen.setdefault(runner.newest.result.sequence, runner.newest.result)

    runner = Runner(prepared, lambda: board)
    path = tmp_path / "before.mcap"
    runner.ask(commands.Record(path))
    runner.start()
    with (
        contextlib.closing(_Stopped(runner)),
        runner.audience.watch(see),
    ):
        until = Watch(runner).until
        until(lambda: len(seen) > 60)
        again = prepare(prepared.skin.altered({"inverse": {"alpha": 0.3}}), prepared)
        runner.ask(commands.Adopt(again))
        until(lambda: runner.prepared is again)
    assert runner.status().recording is None
    with SessionReader(path) as session:
        images = [result.image.values for result in replayed(prepared, session)]
    assert 60 < len(images) <= len(seen)
    for image, result in zip(images, seen.values(), strict=False):
        np.testing.assert_array_equal(image, result.image.values)


class _Stopped:
    def __init__(self, runner):
        self._runner = runner

    def close(self):
        self._runner.stop()


def test_a_named_pattern_is_told_row_by_row(office):
    office.ask({"type": "pattern", "name": "adjacent+opposite"})
    told, pattern = office.page.last("pattern"), named("adjacent+opposite", 8)
    assert told["drive"] == pattern.drive.tolist()
    assert told["measure"] == pattern.measure.tolist()
    assert office.page.last("settings")["undo"] == 0


@pytest.mark.parametrize(
    ("name", "says"), [("zigzag", "expected a pattern among"), ("skip:7", "expected k from 0 to 6")]
)
def test_a_pattern_that_is_not_there_to_be_edited(office, name, says):
    office.ask({"type": "pattern", "name": name})
    assert says in office.page.last("settings_error")["message"]
    assert office.page.last("pattern") is None


def test_a_pattern_too_long_to_be_edited():
    with pytest.raises(PatternError, match=r"at most 2000 rows to edit, got \d{4}"):
        table_of("all_pairs", 20)
