"""The bar of a long job: on a terminal only, and not for what is over at once."""

from __future__ import annotations

import io
import threading

import pytest

from tomoskin.cli.output import Bar


class Terminal(io.StringIO):
    """What a person would see."""

    def isatty(self) -> bool:
        return True


class Never(threading.Timer):
    """A timer whose time does not come."""

    def start(self) -> None:
        pass


class AtOnce(Never):
    """A timer whose time has come when it starts."""

    def start(self) -> None:
        self.function()


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch):
    """Set the time that the bar goes by."""
    now = [100.0]
    monkeypatch.setattr("tomoskin.cli.output.time.monotonic", lambda: now[0])
    monkeypatch.setattr("tomoskin.cli.output.threading.Timer", Never)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.delenv("NO_COLOR", raising=False)
    return now


def job(clock: list[float], seconds: float, fail_at: int = 99) -> None:
    """Ten steps, that long together."""
    with Bar("simulating") as bar:
        for step in range(1, 11):
            clock[0] += seconds / 10
            bar(step, 10)
            1 / (fail_at - step)


@pytest.mark.parametrize(("seconds", "shown"), [(1.9, False), (3.0, True)])
def test_a_terminal_sees_a_bar_after_two_seconds(clock, monkeypatch, seconds, shown):
    monkeypatch.setattr("sys.stderr", terminal := Terminal())
    job(clock, seconds)
    assert ("simulating" in terminal.getvalue()) == shown
    assert ("%" in terminal.getvalue()) == shown


@pytest.mark.usefixtures("clock")
def test_a_job_that_cannot_say_how_far_it_is_is_seen_to_go_on(monkeypatch):
    monkeypatch.setattr("tomoskin.cli.output.threading.Timer", AtOnce)
    monkeypatch.setattr("sys.stderr", terminal := Terminal())
    with Bar("preparing"):
        pass
    shown = terminal.getvalue()
    assert "preparing" in shown
    assert "%" not in shown
    monkeypatch.setattr("sys.stderr", pipe := io.StringIO())
    with Bar("preparing"):
        pass
    assert pipe.getvalue() == ""


def test_a_file_or_a_pipe_sees_none(clock, monkeypatch):
    monkeypatch.setattr("sys.stderr", pipe := io.StringIO())
    job(clock, 60.0)
    assert pipe.getvalue() == ""


def test_it_goes_when_the_job_fails(clock, monkeypatch):
    monkeypatch.setattr("sys.stderr", terminal := Terminal())
    with pytest.raises(ZeroDivisionError):
        job(clock, 40.0, fail_at=6)
    shown = terminal.getvalue()
    assert "60 %" in shown
    assert shown.endswith("\x1b[2K") or "\x1b[?25h" in shown  # the line taken away, the cursor back
