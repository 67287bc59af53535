"""What keeps frames from coming is said on the terminal."""

import threading

from tomoskin.cli.record import recording_to
from tomoskin.core import Event
from tomoskin.run.publisher import EventLog


class Troubled:
    """A runner of which only the events are true."""

    def __init__(self):
        self.events, self.read = self, threading.Semaphore(0)
        self._log = EventLog()

    def say(self, *kinds):
        for kind in kinds:
            self._log.add(Event(0.0, kind, f"this is {kind}"))

    def since(self, number):
        self.read.release()
        return self._log.since(number)

    def start(self):
        """Nothing."""

    stop = start


def test_troubles_are_told_and_their_end(capsys):
    runner = Troubled()
    runner.say("connected", "touch", "no-answer", "connected", "connected", "source-lost")
    with recording_to(runner, None):
        for _ in range(2):
            assert runner.read.acquire(timeout=60)
    told = capsys.readouterr().err.splitlines()
    assert told == [
        f"tomoskin: this is {kind}" for kind in ("no-answer", "connected", "source-lost")
    ]
