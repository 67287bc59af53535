"""The check of a new board, on the real firmware: a sound one passes, planted faults are named."""

from __future__ import annotations

import json
from typing import Any

import pytest

from firmware.emulator.faulty import BoardFaults
from tomoskin.board.source import BOARDS
from tomoskin.cli import main
from tomoskin.run import CheckFinding, check_board
from tomoskin.sensing.signal import LoadRing
from tomoskin_emulator import emulate_load
from tomoskin_emulator.program import Programs

CURRENT = 0.1
FAULTS = {
    "E3 is never connected to the current": BoardFaults(high_open=[2]),
    "E3 is never connected to ground": BoardFaults(low_open=[2]),
    "E6 is always connected to the current": BoardFaults(high_stuck=[5]),
    "E6 is always connected to ground": BoardFaults(low_stuck=[5]),
    "the readings of E2 and E7 are exchanged": BoardFaults(reading={1: 6, 6: 1}),
    "the sinks E4 and E5 are exchanged": BoardFaults(sink={3: 4, 4: 3}),
    "address line 1 of the sources is always low": BoardFaults(
        source={e: e & ~2 for e in range(8)}
    ),
}


@pytest.fixture(autouse=True)
def _built(programs: Programs, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tomoskin_emulator.source.programs_of", lambda _: programs)


def findings(
    faults: BoardFaults | None = None, channels: int = 8, five_volts: float | None = None
) -> list[CheckFinding]:
    ring, broken = LoadRing.for_current(channels, CURRENT), (faults or BoardFaults()).pack()
    with emulate_load(ring.resistance, CURRENT, faults=broken) as transport:
        return list(check_board(transport, ring, CURRENT, five_volts=five_volts, frames=4))


def test_a_sound_board_passes() -> None:
    found = findings()
    assert [one.text for one in found if not one.ok] == []
    names = ["handshake", "channels", "current", "sinks", "noise", "settling"]
    assert [one.name for one in found] == [*names, "stop", "silence", "safe off"]


def test_the_measured_five_volts_are_the_converters_reference() -> None:
    """The emulated converter has 5 V; a meter that shows less says that less current flows."""
    (wrong,) = [one.text for one in findings(five_volts=4.6) if not one.ok]
    assert "0.92 times" in wrong
    (current,) = [one.text for one in findings() if one.name == "current"]
    assert " mA through resistors" in current
    assert "--five-volts" in current


def _one_fault(said: str) -> None:
    wrong = [one.text for one in findings(FAULTS[said]) if not one.ok]
    assert len(wrong) == 1
    assert wrong[0].startswith(said)


def test_a_stuck_transistor_is_named() -> None:
    _one_fault("E6 is always connected to the current")


@pytest.mark.slow
@pytest.mark.parametrize("said", FAULTS)
def test_each_planted_fault_is_named(said: str) -> None:
    _one_fault(said)


@pytest.mark.slow
def test_a_board_of_sixteen_passes() -> None:
    assert all(one.ok for one in findings(channels=16))


@pytest.mark.slow
def test_a_pico_passes(pico: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tomoskin_emulator.source.programs_of", lambda _: pico)
    record = BOARDS["pico"]
    ring = LoadRing.for_current(8, CURRENT, record.ring_drop)
    with emulate_load(ring.resistance, CURRENT, "pico") as transport:
        assert all(one.ok for one in check_board(transport, ring, CURRENT, frames=4))


@pytest.mark.slow
def test_the_command_says_what_it_found(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as end:
        main(["board", "check", "--source", "emulator", "--no-meter", "--json"])
    document = json.loads(capsys.readouterr().out)
    assert end.value.code == 0
    assert document["ok"]
    assert len(document["findings"]) == 9
