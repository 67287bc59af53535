"""The queue and thread before a sink: nothing that a sink does delays whoever feeds it."""

from __future__ import annotations

import threading
from collections import deque

import pytest

from sink.conftest import EVENT, PATIENCE, moment_at
from tomoskin.core import Event, SinkError
from tomoskin.sink import Outlets
from tomoskin.sink.outlet import IMAGE_PERIOD, MOST_WAITING, Outlet


class Shelf:
    """A sink that keeps what it is given; ``behave`` runs before each call to ``publish``."""

    name = "shelf"

    def __init__(self, news, behave=lambda: None, opens=()):
        self.items, self.calls = [], []
        self._news, self._behave, self._opens = news, behave, deque(opens)

    def open(self, _):
        self.calls.append("open")
        if self._opens and (error := self._opens.popleft()) is not None:
            raise error

    def publish(self, item):
        self._behave()
        with self._news.changed:
            self.items.append(item)
            self._news.changed.notify_all()

    def close(self):
        self.calls.append("close")


@pytest.fixture
def running(news, stream):
    """Make an outlet run; stopped afterwards."""
    begun = []

    def run(sink):
        outlet = Outlet(sink, news)
        begun.append(outlet)
        outlet.start(stream)
        news.until(news.kinds)
        return outlet

    yield run
    for outlet in begun:
        outlet.end()
        outlet.join()


def test_everything_comes_in_order(running, news):
    sink = Shelf(news)
    outlet = running(sink)
    put = [moment_at(0.0), EVENT, moment_at(1.0, sequence=1)]
    for number, item in enumerate(put, start=1):
        outlet.put(item)
        news.until(lambda n=number: len(sink.items) == n)
    assert sink.items == put
    outlet.end()
    outlet.join()
    assert sink.calls == ["open", "close"]
    report = outlet.report()
    assert (report.well, report.text, report.sent) == (True, "3 sent", 3)
    assert news.said == [("sink-open", "shelf takes results")]


def test_images_are_the_newest_only_and_now_and_then(running, news):
    go = threading.Event()
    sink = Shelf(news, behave=lambda: go.wait(PATIENCE))
    outlet = running(sink)
    times = [0.0, 0.3, 0.4, 0.5]
    for time in times:
        outlet.put(moment_at(time))
    go.set()
    news.until(lambda: len(sink.items) == 4)
    outlet.put(moment_at(0.5 + 0.9 * IMAGE_PERIOD))
    outlet.put(moment_at(0.1))  # a replay that begins anew
    news.until(lambda: len(sink.items) == 6)
    shown = [item.host_time for item in sink.items if item.image is not None]
    assert shown in ([0.0, 0.5, 0.1], [0.5, 0.1])
    assert [item.host_time for item in sink.items[:4]] == times


def test_a_sink_that_hangs_delays_nobody_and_is_left_to_itself(running, news, monkeypatch):
    monkeypatch.setattr("tomoskin.sink.outlet.GRACE", 0.05)
    monkeypatch.setattr("tomoskin.sink.outlet._LONG", 0.0)
    asked, for_ever = threading.Event(), threading.Event()

    def hang():
        asked.set()
        for_ever.wait(PATIENCE)

    outlet = running(Shelf(news, behave=hang))
    outlet.put(moment_at(-1.0))
    assert asked.wait(PATIENCE)
    for number in range(MOST_WAITING + 12):
        outlet.put(moment_at(number))
    outlet.put(EVENT)
    report = outlet.report()
    assert not report.well
    assert report.text.startswith("does not answer")
    assert report.left_out == 12 + 1
    assert news.kinds().count("sink-behind") == 1
    outlet.end()
    outlet.join()
    assert news.kinds()[-1] == "sink-stuck"
    for_ever.set()


def test_a_slow_sink_loses_results_which_are_counted_and_said(running, news):
    steps = threading.Semaphore(0)
    sink = Shelf(news, behave=lambda: steps.acquire(timeout=PATIENCE))
    outlet = running(sink)
    outlet.put(moment_at(-1.0))
    for number in range(MOST_WAITING + 40):
        outlet.put(moment_at(number))
    steps.release(MOST_WAITING + 41)
    news.until(lambda: "sink-gap" in news.kinds())
    assert outlet.left_out + len(sink.items) == MOST_WAITING + 41
    gap = next(text for kind, text in news.said if kind == "sink-gap")
    assert gap == f"shelf {outlet.left_out} results were left out"
    assert sink.items[-1].host_time == MOST_WAITING + 39  # the newest are kept
    assert outlet.report().text == f"{len(sink.items)} sent, {outlet.left_out} left out"


def test_a_sink_that_raises_is_closed_and_opened_again(running, news, monkeypatch, caplog):
    monkeypatch.setattr("tomoskin.sink.outlet._FIRST_DELAY", 0.001)
    faults = deque([ConnectionResetError(104, "peer is gone"), None])

    def fail():
        if faults and (error := faults.popleft()):
            raise error

    sink = Shelf(news, behave=fail)
    outlet = running(sink)
    outlet.put(moment_at(0.0))
    news.until(lambda: news.kinds().count("sink-open") == 2)
    outlet.put(moment_at(1.0))
    news.until(lambda: sink.items)
    assert sink.calls == ["open", "close", "open"]
    away = next(text for kind, text in news.said if kind == "sink-away")
    assert away == "shelf is away: peer is gone"
    assert away in caplog.text


def test_a_sink_that_cannot_be_opened_is_said_once_and_tried_again(running, news, monkeypatch):
    monkeypatch.setattr("tomoskin.sink.outlet._FIRST_DELAY", 0.001)
    refused = SinkError("no broker there", where="shelf")
    sink = Shelf(news, opens=[refused] * 3)
    outlet = running(sink)
    outlet.put(moment_at(0.0))
    outlet.put(EVENT)
    news.until(lambda: sink.items)
    assert sink.calls.count("open") == 4
    assert news.kinds() == ["sink-away", "sink-open"]
    assert isinstance(sink.items[0], Event)  # what was touched meanwhile is no news any more
    assert outlet.left_out == 1


def test_while_it_is_away_that_is_its_state(running, news, monkeypatch):
    monkeypatch.setattr("tomoskin.sink.outlet._FIRST_DELAY", PATIENCE)
    outlet = running(
        Shelf(news, opens=[SinkError("no broker there", where="shelf", hint="start it")])
    )
    report = outlet.report()
    assert (report.well, report.text) == (False, "is away: no broker there (start it)")
    for number in range(MOST_WAITING + 3):
        outlet.put(moment_at(number))
    assert outlet.report().text == "is away: no broker there (start it), 3 left out"
    assert news.kinds() == ["sink-away"]


def test_what_waits_is_sent_before_the_end(news, stream):
    sinks = [Shelf(news), Shelf(news)]
    outlets = Outlets(sinks, news)
    assert outlets
    outlets.start(stream)
    news.until(lambda: news.kinds().count("sink-open") == 2)
    for number in range(50):
        outlets.put(moment_at(number))
    outlets.stop()
    assert [len(sink.items) for sink in sinks] == [50, 50]
    outlets.stop()
    assert not Outlets((), news)
