"""The queue and thread before a consumer: nothing that it does delays whoever feeds it."""

from __future__ import annotations

import threading
from collections import deque

import pytest

from run.sinks.conftest import EVENT, PATIENCE, result_at
from tomoskin.core import Capacity, Consumer, Event, SinkError, Worker, stop_workers
from tomoskin.files.messages.reporter import IMAGE_PERIOD
from tomoskin.run.sinks import Sink, sink_report, sink_worker
from tomoskin.run.sinks.sink import MOST_WAITING


class Shelf(Sink):
    """A sink that keeps what it is given; ``behave`` runs before each call to ``publish``."""

    name = "shelf"

    def __init__(self, news, behave=lambda: None, opens=()):
        self.items, self.calls = [], []
        self._news, self._behave, self._opens = news, behave, deque(opens)

    def open(self, _):
        self.calls.append("open")
        match self._opens.popleft() if self._opens else None:
            case threading.Event() as permission:
                permission.wait(PATIENCE)
            case Exception() as error:
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
    """Make a worker run; stopped afterwards."""
    begun = []

    def run(sink):
        worker = sink_worker(sink, stream, news)
        begun.append(worker)
        worker.start()
        news.until(news.kinds)
        return worker

    yield run
    stop_workers(begun)


def test_everything_comes_in_order(running, news):
    sink = Shelf(news)
    worker = running(sink)
    put = [result_at(0.0), EVENT, result_at(1.0, sequence=1)]
    for number, item in enumerate(put, start=1):
        worker.put(item)
        news.until(lambda n=number: len(sink.items) == n)
    assert [item.host_time for item in sink.items] == [0.0, EVENT.host_time, 1.0]
    assert sink.items[1] is EVENT
    assert sink.items[2].sequence == 1
    worker.end()
    worker.join()
    assert sink.calls == ["open", "close"]
    report = sink_report(worker)
    assert (report.well, report.text, report.sent) == (True, "3 sent", 3)
    assert news.said == [("sink-open", "shelf takes results")]


def test_images_are_the_newest_only_and_now_and_then(running, news):
    go = threading.Event()
    sink = Shelf(news, behave=lambda: go.wait(PATIENCE))
    worker = running(sink)
    times = [0.0, 0.3, 0.4, 0.5]
    for time in times:
        worker.put(result_at(time))
    go.set()
    news.until(lambda: len(sink.items) == 4)
    worker.put(result_at(0.5 + 0.9 * IMAGE_PERIOD))
    worker.put(result_at(0.1))  # a replay that begins anew
    news.until(lambda: len(sink.items) == 6)
    shown = [item.host_time for item in sink.items if item.image is not None]
    assert shown in ([0.0, 0.5, 0.1], [0.5, 0.1])
    assert [item.host_time for item in sink.items[:4]] == times


def test_a_sink_that_hangs_delays_nobody_and_is_left_to_itself(running, news, monkeypatch):
    monkeypatch.setattr("tomoskin.run.sinks.sink.GRACE", 0.05)
    monkeypatch.setattr("tomoskin.run.sinks.sink._LONG", 0.0)
    asked, for_ever = threading.Event(), threading.Event()

    def hang():
        asked.set()
        for_ever.wait(PATIENCE)

    worker = running(Shelf(news, behave=hang))
    worker.put(result_at(-1.0))
    assert asked.wait(PATIENCE)
    for number in range(MOST_WAITING + 12):
        worker.put(result_at(number))
    worker.put(EVENT)
    report = sink_report(worker)
    assert not report.well
    assert report.text.startswith("has not answered")
    assert report.left_out == 12 + 1
    assert news.kinds().count("sink-behind") == 1
    worker.end()
    worker.join()
    assert news.kinds()[-1] == "sink-stuck"
    for_ever.set()


def test_a_slow_sink_loses_results_which_are_counted_and_said(running, news):
    steps = threading.Semaphore(0)
    sink = Shelf(news, behave=lambda: steps.acquire(timeout=PATIENCE))
    worker = running(sink)
    worker.put(result_at(-1.0))
    for number in range(MOST_WAITING + 40):
        worker.put(result_at(number))
    steps.release(MOST_WAITING + 41)
    news.until(lambda: "sink-gap" in news.kinds())
    assert worker.left_out + len(sink.items) == MOST_WAITING + 41
    gap = next(text for kind, text in news.said if kind == "sink-gap")
    assert gap == f"shelf {worker.left_out} messages were left out"
    assert sink.items[-1].host_time == MOST_WAITING + 39  # the newest are kept
    assert sink_report(worker).text == f"{len(sink.items)} sent, {worker.left_out} left out"


def test_a_sink_that_raises_is_closed_and_opened_again(running, news, monkeypatch, caplog):
    monkeypatch.setattr("tomoskin.run.sinks.sink._FIRST_DELAY", 0.001)
    faults = deque([ConnectionResetError(104, "peer is gone"), None])

    def fail():
        if faults and (error := faults.popleft()):
            raise error

    sink = Shelf(news, behave=fail)
    worker = running(sink)
    worker.put(result_at(0.0))
    news.until(lambda: news.kinds().count("sink-open") == 2)
    worker.put(result_at(1.0))
    news.until(lambda: sink.items)
    assert sink.calls == ["open", "close", "open"]
    away = next(text for kind, text in news.said if kind == "sink-away")
    assert away == "shelf is not reachable: peer is gone"
    assert away in caplog.text


def test_a_sink_that_cannot_be_opened_is_said_once_and_tried_again(running, news, monkeypatch):
    monkeypatch.setattr("tomoskin.run.sinks.sink._FIRST_DELAY", 0.001)
    refused = SinkError("no broker there", where="shelf")
    both_are_there = threading.Event()
    sink = Shelf(news, opens=[refused, refused, refused, both_are_there])
    worker = running(sink)
    worker.put(result_at(0.0))
    worker.put(EVENT)
    both_are_there.set()
    news.until(lambda: sink.items)
    assert sink.calls.count("open") == 4
    assert news.kinds() == ["sink-away", "sink-open"]
    assert isinstance(sink.items[0], Event)  # what was touched meanwhile is no news any more
    assert worker.left_out == 1


def test_while_it_is_away_that_is_its_state(running, news, monkeypatch):
    monkeypatch.setattr("tomoskin.run.sinks.sink._FIRST_DELAY", PATIENCE)
    worker = running(
        Shelf(news, opens=[SinkError("no broker there", where="shelf", hint="start it")])
    )
    report = sink_report(worker)
    assert (report.well, report.text) == (False, "is not reachable: no broker there (start it)")
    for number in range(MOST_WAITING + 3):
        worker.put(result_at(number))
    left_out = MOST_WAITING + 3
    assert (
        sink_report(worker).text
        == f"is not reachable: no broker there (start it), {left_out} left out"
    )
    assert news.kinds() == ["sink-away"]


def test_what_waits_is_sent_before_the_end(news, stream):
    sinks = [Shelf(news), Shelf(news)]
    workers = [sink_worker(sink, stream, news) for sink in sinks]
    for worker in workers:
        worker.start()
    news.until(lambda: news.kinds().count("sink-open") == 2)
    for number in range(50):
        for worker in workers:
            worker.put(result_at(number))
    stop_workers(workers)
    assert [len(sink.items) for sink in sinks] == [50, 50]
    stop_workers(workers)


class Jar(Consumer):
    """A consumer that takes one item at a time, when it is told to."""

    kind, name, slow = "jar", "the jar", "is slow"

    def __init__(self):
        self.items, self.go = [], threading.Semaphore(0)

    def admit(self, message):
        return message

    def take(self, item):
        assert self.go.acquire(timeout=PATIENCE)
        self.items.append(item)


@pytest.mark.parametrize(("keeps", "kept"), [("oldest", [0, 1, 2, 3]), ("newest", [0, 7, 8, 9])])
def test_of_too_much_the_oldest_or_the_newest_stays(news, keeps, kept):
    jar = Jar()
    worker = Worker(jar, Capacity(3, keeps), news)
    worker.start()
    worker.opening.result(PATIENCE)
    worker.put(0)
    while not worker.silent:  # it has the first in hand
        pass
    for number in range(1, 10):
        worker.put(number)
    assert worker.left_out == 6
    jar.go.release(10)
    worker.end()
    worker.ending.result(PATIENCE)
    assert jar.items == kept
    assert news.said == [
        ("jar-behind", "the jar is slow"),
        ("jar-gap", "the jar 6 messages were left out"),
    ]


def test_what_is_said_of_a_worker_may_go_to_that_worker():
    """As the events of a run do: its recording is told that it does not keep up."""
    jar = Jar()
    worker = Worker(jar, Capacity(1, "oldest"), lambda *said: worker.put(said))
    worker.start()
    for number in range(5):
        worker.put(number)
    jar.go.release(10)
    worker.end()
    worker.ending.result(PATIENCE)
    assert jar.items[0] == 0


def test_a_consumer_that_fails_for_good_ends(news):
    class Broken(Jar):
        def take(self, item):
            raise ValueError(item)

    worker = Worker(Broken(), Capacity(3, "oldest"), news)
    worker.start()
    worker.put(1)
    worker.ending.result(PATIENCE)
    worker.put(2)
    worker.join()
    assert (worker.taken, worker.left_out) == (0, 0)


def test_a_consumer_that_lets_messages_gather_is_not_woken_by_each(news, monkeypatch):
    class Gathering(Jar):
        gathering = 0.05

    jar = Gathering()
    jar.go.release(100)
    worker, woken = Worker(jar, Capacity(100, "oldest"), news), []
    worker.start()
    worker.opening.result(PATIENCE)
    with monkeypatch.context() as patch:
        patch.setattr(worker._news, "notify", lambda: woken.append(worker.taken))
        for number in range(50):
            worker.put(number)
            threading.Event().wait(0.002)
    worker.end()
    worker.ending.result(PATIENCE)
    assert jar.items == list(range(50))
    assert woken == []
