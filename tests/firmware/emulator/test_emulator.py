"""The real ELF on a simulated ATmega2560, from the sheet to the frames."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from firmware.boards import FIRMWARE, SCAN, SETTINGS
from tomoskin.board.source import Link, ScanSettings, SerialTransport
from tomoskin.cli.app import app
from tomoskin.core import Frame, SourceError
from tomoskin.model.skin import Skin
from tomoskin.twin import Press, TwinSettings, TwinSkin
from tomoskin_emulator import EmulatorTransport, emulate_board, program as building
from tomoskin_emulator.board_process import Front, SkinMemory
from tomoskin_emulator.program import Programs
from tomoskin_emulator.source import front_of, open_emulator

PATIENCE = 120.0


@pytest.fixture(scope="module")
def skin() -> Skin:
    return Skin.load("textile-disc-8")


@pytest.fixture
def quiet() -> TwinSettings:
    return TwinSettings.preset("ideal").with_noise(0.0)


def frames_of(link: Link, count: int) -> list[Frame]:
    frames: list[Frame] = []
    end = time.monotonic() + PATIENCE
    while len(frames) < count:
        assert time.monotonic() < end
        frames += [item for item in link.poll(0.05) if isinstance(item, Frame)]
    return frames


def expected(sheet: TwinSkin, front: Front, oversampling: int) -> np.ndarray:
    """Codes from the sheet's own resistance, by another way than the emulator's."""
    r = sheet.resistance()
    source, sink = SCAN.drives[SCAN.sample_drive].T
    e = SCAN.sample_electrode
    volts = front.current * (r[source, e] - r[sink, e] - r[source, sink] + r[sink, sink])
    codes = np.floor((front.gain * volts + front.offset) * front.levels / front.reference)
    return oversampling * np.clip(codes, 0, front.levels - 1)


def test_frames_are_what_the_sheet_says_and_follow_a_press(
    programs: Programs, skin: Skin, quiet: TwinSettings
) -> None:
    sheet, front = TwinSkin.of(skin, quiet), front_of(skin, quiet)
    transport = EmulatorTransport(programs, sheet, front)
    with Link(transport, SCAN, SETTINGS) as link:
        before = frames_of(link, 20)
        wanted = expected(sheet, front, SETTINGS.oversampling)
        for number, frame in enumerate(before):
            assert frame.sequence == number
            assert frame.samples.tolist() == wanted.tolist()
        transport.set_presses((Press(0.01, 0.0, 5.0, 0.01),))
        frames_of(link, 20)
        end = time.monotonic() + PATIENCE
        while True:  # the sheet goes on yielding, and frames of earlier are still on the way
            pressed = frames_of(link, 1)[0].samples
            if pressed.tolist() == expected(sheet, front, SETTINGS.oversampling).tolist():
                break
            assert time.monotonic() < end
        assert np.abs(pressed.astype(int) - wanted).max() >= 10
        assert link.counters.corrupt == 0
        assert link.frames.lost == 0
        assert transport.complaints == ""


def test_stop_and_closing_end_it(programs: Programs, skin: Skin, quiet: TwinSettings) -> None:
    transport = EmulatorTransport(programs, TwinSkin.of(skin, quiet), front_of(skin, quiet))
    link = Link(transport, SCAN, SETTINGS)
    frames_of(link, 2)
    link.close()
    transport.close()
    with pytest.raises(SourceError, match="switched off"):
        transport.read(0.0)


def test_the_skins_own_scan(programs: Programs, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tomoskin_emulator.source.programs_of", lambda _: programs)
    skin = Skin.load("textile-disc-8")
    with Link(open_emulator("seed=2", skin), SCAN, ScanSettings.of(skin)) as link:
        assert link.connect().unique_id == b"emulated"
        frames_of(link, 2)


@pytest.mark.parametrize("argument", ["seed=x", "preset=nowhere", "speed=3"])
def test_bad_options_are_said(skin: Skin, argument: str) -> None:
    with pytest.raises(SourceError, match="expected"):
        open_emulator(argument, skin)


def test_what_cannot_be_built_is_said(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr("shutil.which", lambda _: None)
    with pytest.raises(SourceError, match="avr-gcc"):
        building.programs_of("mega")
    monkeypatch.setattr(building, "FOLDER", tmp_path / "none")
    with pytest.raises(SourceError, match="sources are not here"):
        building.programs_of("mega")


def test_a_skin_with_too_many_electrodes(tmp_path: Path) -> None:
    with pytest.raises(SourceError, match="at most 32"):
        SkinMemory(tmp_path / "skin", Front(*[1.0] * 7), np.eye(33))


def test_the_memory_is_the_c_structs(tmp_path: Path) -> None:
    path = tmp_path / "skin"
    SkinMemory(path, Front(1, 2, 3, 4, 5, 6, 7), np.eye(2)).close()
    data = path.read_bytes()
    header = (FIRMWARE / "host" / "skin.h").read_text(encoding="utf-8")
    assert f"0x{int.from_bytes(data[:8], 'little'):X}" in header
    assert int.from_bytes(data[8:12], "little") % 2 == 0
    assert np.frombuffer(data, "<f8", 11, 16).tolist() == [1, 2, 3, 4, 5, 6, 7, 1, 0, 0, 1]


def test_a_board_for_another_host(programs: Programs, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tomoskin_emulator.source.programs_of", lambda _: programs)
    skin = Skin.load("textile-disc-8")
    with emulate_board(skin) as board, Link(SerialTransport(board.port), SCAN, SETTINGS) as link:
        frames_of(link, 2)
        assert board.alive
    assert board.last_words == ""


def test_the_command_line_builds_and_says_what_is_missing(
    programs: Programs, monkeypatch: pytest.MonkeyPatch
) -> None:
    said = CliRunner().invoke(app, ["firmware", "build", "--channels", "16"])
    assert said.exit_code == 0
    assert Path(said.output.strip()) == programs.elf
    monkeypatch.setattr("shutil.which", lambda _: None)
    said = CliRunner().invoke(app, ["firmware", "flash", "/dev/nowhere"])
    assert isinstance(said.exception, SourceError)
    assert "avrdude" in str(said.exception)
