"""The first power-up at a terminal: readings are asked for, and a wrong one ends it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import pytest
from typer.testing import CliRunner

from tomoskin.cli.board import app
from tomoskin.run import CheckFinding
from tomoskin.sensing.signal import meter_steps

GOOD = [f"{(step.low + step.high) / 2:.3f}" for step in meter_steps(0.1, 8)]


@pytest.fixture(autouse=True)
def board(monkeypatch: pytest.MonkeyPatch) -> None:
    """A board of which only the second part of the check says that all is well."""

    @contextmanager
    def opened(*_: object) -> Iterator[None]:
        yield None

    def checked(*_: object, **_named: object) -> list[CheckFinding]:
        return [CheckFinding("handshake", True, "a board")]

    monkeypatch.setattr("tomoskin.cli.board._opened", opened)
    monkeypatch.setattr("tomoskin.run.check_board", checked)


def test_every_reading_is_asked_for_and_said() -> None:
    done = CliRunner().invoke(app, ["check"], input="\n".join([*GOOD, ""]))
    assert done.exit_code == 0
    lines = [line for line in done.stdout.splitlines() if line.startswith("ok")]
    assert len(lines) == len(GOOD) + 1


def test_a_wrong_reading_ends_it_with_where_to_look() -> None:
    wrong = [*GOOD[:6], "2,7 V"]
    done = CliRunner().invoke(app, ["check"], input="\n".join([*wrong, ""]))
    assert done.exit_code == 1
    assert "2.5V: 2.7 V, expected 2.49 to 2.51 V: U2, U3" in done.stdout
    assert "start again" in done.stderr
    assert "a board" not in done.stdout


def test_what_is_no_number_is_asked_for_again_and_enter_leaves_one_out() -> None:
    done = CliRunner().invoke(app, ["check"], input="twelve\n" + "\n" * len(GOOD))
    assert done.exit_code == 0
    assert 'expected volts, such as 2.20, got "twelve"' in done.stderr
    assert "a board" in done.stdout


def test_what_is_right_follows_from_the_readings_before() -> None:
    """11.45 V at +12V: 10.22 V are right at SENSE; the nominal 12 V would refuse them."""
    low = ["11.5", "0.1", "0", "4.8", "11.45", "-4.5", "2.5", "2.2", "10.22", "0", "0", "0", ""]
    done = CliRunner().invoke(app, ["check"], input="\n".join(low))
    assert done.exit_code == 0
    assert done.stdout.count("ok  ") == len(low)


def test_a_current_that_the_parts_cannot_carry_is_refused() -> None:
    done = CliRunner().invoke(app, ["check", "--current", "1 A"])
    assert done.exit_code == 2
    assert "expected 1 µA to 100 mA" in done.stderr
