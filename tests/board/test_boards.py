"""A board is one record: a made-up third one is driven by the twin and looked at by the check."""

from __future__ import annotations

from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import msgspec
import numpy as np
import pytest
from numpy.typing import NDArray
from serial.tools.list_ports_common import ListPortInfo

from board.source.boards import NOTHING
from firmware.boards import FIRMWARE
from tomoskin.board.source import (
    BOARDS,
    BoardRecord,
    Configuration,
    Link,
    ScanSettings,
    list_ports,
    open_source,
    read_options,
)
from tomoskin.board.source.boards import read_boards
from tomoskin.core import Frame, SourceError, WallClock
from tomoskin.model.pattern import Scan
from tomoskin.model.skin import Skin
from tomoskin.run import CheckFinding, check_board
from tomoskin.sensing.signal import LoadRing, Readout
from tomoskin.twin import Board, ElectronicsSettings, Faults, SampleTable, TwinTransport
from tomoskin.twin.circuit import line_potentials
from tomoskin.twin.device import TwinDevice
from tomoskin.twin.electronics import convert
from tomoskin.twin.source import read_board
from tomoskin_emulator import build_firmware, program
from tomoskin_emulator.program import programs_of

TEXT = files("tomoskin.board.source").joinpath("boards.toml").read_text(encoding="utf-8")
THIRD = """
[third]
text = "Third board"
channels = [24]
adc_bits = 11
max_drives = 64
max_samples = 900
tick_rate = 1e6
current = 0.05
gain = 20
reference = 3.0
usb = [[0x1234, 0x5678]]

[third.converter]
clock = 10e6
divided = false
clocks = 20
dropped = 1
"""
CURRENT = 0.05


@pytest.fixture
def third(monkeypatch: pytest.MonkeyPatch) -> BoardRecord:
    record = read_boards(TEXT + THIRD)["third"]
    monkeypatch.setitem(BOARDS, "third", record)
    return record


class OnRing:
    """The electronics of a record's board before a ring of resistors."""

    def __init__(self, record: BoardRecord, ring: LoadRing) -> None:
        self._resistance = ring.resistance
        self._readout = replace(
            Skin.load("textile-disc-8").readout,
            adc_bits=record.adc_bits,
            gain=record.gain,
            reference_voltage=record.reference,
        )
        self._random = np.random.default_rng(0)

    def sample(self, table: SampleTable, _time: float) -> NDArray[np.uint16]:
        """What the board reads of the ring, whatever the time."""
        electronics = ElectronicsSettings(noise=0.7, switch_resistance=0.04)
        lines = line_potentials(
            self._resistance,
            table.drives,
            CURRENT,
            contact=np.zeros(len(self._resistance)),
            faults=Faults(),
            settings=electronics,
        )
        volts = lines.read[table.drive, table.channel]
        return convert(volts, self._readout, table.oversampling, electronics, self._random)


def findings(board: Board, record: BoardRecord) -> dict[str, CheckFinding]:
    """What the check says of a ``board`` whose amplifiers are those of a ``record``."""
    ring, clock = LoadRing.for_current(8, CURRENT), WallClock()
    device = TwinDevice(OnRing(record, ring), board, clock.now())
    transport = TwinTransport(NOTHING, device, clock)
    return {one.name: one for one in check_board(transport, ring, CURRENT, frames=4)}


def frames_of(link: Link, count: int) -> list[Frame]:
    """The next ``count`` frames."""
    frames: list[Frame] = []
    while len(frames) < count:
        frames += [item for item in link.poll(0.1) if isinstance(item, Frame)]
    return frames[:count]


@pytest.mark.usefixtures("third")
def test_the_twin_is_the_third_board() -> None:
    skin = Skin.load("textile-disc-8")
    scan, settings, volts = Scan.of(skin.pattern()), ScanSettings.of(skin), []
    readout = Readout.of(scan, skin.readout)
    for source in ("twin:preset=ideal,fast", "twin:preset=ideal,fast,board=third"):
        with Link(open_source(source, skin), scan, settings) as link:
            frames = frames_of(link, 20)
            volts.append(np.mean([readout(frame).values for frame in frames], axis=0))
    assert volts[1] == pytest.approx(volts[0], abs=1e-4)
    info, board = link.session.info, link.session.board
    assert info is not None
    assert board is not None
    assert (info.channels, info.adc_bits, info.max_samples) == (24, 11, 900)
    assert board.text == "Third board"
    conversions = scan.n_samples * (settings.oversampling // 2 + 1)
    seconds = len(scan.drives) * (settings.settling + settings.dead_time) + 2e-6 * conversions
    assert link.session.configuration.scan_time == pytest.approx(seconds)
    assert frames[9].ticks - frames[8].ticks == pytest.approx(1e6 * seconds, abs=1)


def test_the_scan_of_a_board_that_is_not_known_takes_what_it_says(third: BoardRecord) -> None:
    skin = Skin.load("textile-disc-8")
    settings = ScanSettings.of(skin)
    asked = Configuration.of(Scan.of(skin.pattern()), settings)
    stranger = replace(third.limits, name=b"Stranger", sample=3000, conversion=1000, clock=10)
    each = 3e-6 + settings.oversampling * (1e-6 + 10e-9 * settings.prescaler)
    rest = asked.scan.n_drives * (settings.settling + settings.dead_time)
    fitted = asked.on_board(settings, stranger)
    assert fitted.scan_time == pytest.approx(rest + asked.n_samples * each)
    assert fitted.identity == asked.identity


def test_a_sound_third_board_passes_its_check(third: BoardRecord) -> None:
    made = findings(Board.of(third, 8, CURRENT, b"a third!"), third)
    assert [one.text for one in made.values() if not one.ok] == []
    assert made["handshake"].text.startswith("Third board, firmware")
    assert float(made["current"].text.split()[0]) == pytest.approx(50, rel=0.01)


def test_a_board_that_is_not_as_its_record_is_told_and_counts(third: BoardRecord) -> None:
    other = replace(Board.of(third, 8, CURRENT, b"a third!"), adc_bits=12)
    made = findings(other, msgspec.structs.replace(third, adc_bits=12))
    assert [one.name for one in made.values() if not one.ok] == ["record"]
    assert "adc_bits 12 instead of 11" in made["record"].text


def test_what_it_has_not_is_said(third: BoardRecord) -> None:
    with pytest.raises(SourceError, match="no firmware for the Third board"):
        build_firmware(third, 24)
    with pytest.raises(SourceError, match=r"no emulator of the Third board.*twin:board=third"):
        programs_of("third")
    with pytest.raises(SourceError, match=r'expected a board among mega, .*third, got "fourth"'):
        open_source("twin:board=fourth", Skin.load("textile-disc-8"))


def test_a_build_that_makes_nothing_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(program, "BUILD", tmp_path)
    monkeypatch.setattr(program, "_make", lambda *_: None)
    with pytest.raises(SourceError, match=r"the rule .* made no .*elf"):
        build_firmware(BOARDS["mega"], 8)


@pytest.mark.usefixtures("third")
def test_twin_and_emulator_name_a_board_in_one_way() -> None:
    for given in ("board=third", "third", "seed=3,board=third"):
        assert read_board(read_options(given, ("seed", "board", *BOARDS), "a"), "a") == "third"
    assert read_board({}, "a") is None
    with pytest.raises(SourceError, match="one board, got mega and third"):
        read_board({"third": "", "board": "mega"}, "a")
    skin = Skin.load("textile-disc-8")
    for name in ("twin", "emulator"):
        with pytest.raises(SourceError, match='got "pcio"; did you mean "pico"'):
            open_source(f"{name}:board=pcio", skin)
    for given in ("board=third", "third"):  # it has no emulator, and is a twin
        with pytest.raises(SourceError, match="no emulator of the Third board"):
            open_source(f"emulator:{given}", skin)
        open_source(f"twin:{given}", skin).close()


def test_its_port_is_known(third: BoardRecord, monkeypatch: pytest.MonkeyPatch) -> None:
    def ports() -> list[ListPortInfo]:
        one = ListPortInfo("/dev/ttyACM9")
        one.vid, one.pid = third.usb[0]
        return [one]

    monkeypatch.setattr("serial.tools.list_ports.comports", ports)
    assert [str(port) for port in list_ports()] == ["/dev/ttyACM9 (Third board)"]


@pytest.mark.parametrize("key", ["adc_bits = 11", "clocks = 20"])
def test_a_wrong_key_is_an_error(key: str) -> None:
    with pytest.raises(msgspec.ValidationError, match="unknown field"):
        read_boards(TEXT + THIRD.replace(key, f"{key}\nnonsense = 1"))


@pytest.mark.parametrize("name", BOARDS)
def test_each_board_has_its_folder(name: str) -> None:
    record = BOARDS[name]
    assert record.firmware is not None
    folder = FIRMWARE / record.firmware.folder
    makefile = (folder / "board.mk").read_text(encoding="utf-8")
    assert f"\n{record.firmware.make}: " in makefile
    assert f"\n{record.firmware.make_image}: " in makefile
    assert any(f'"{record.text}"' in file.read_text("utf-8") for file in folder.glob("hal_*.c"))
