"""What is written into a board: by the real avrdude, to a bootloader on a pty."""

from __future__ import annotations

import struct
from contextlib import closing

import pytest

from firmware.boards import SCAN, SETTINGS, built, running
from firmware.conftest import need
from firmware.emulator.bootloader import Mega
from firmware.emulator.test_emulator import frames_of
from tomoskin.board.source import Link, SerialTransport, ask_info
from tomoskin.cli import main
from tomoskin.core import SourceError
from tomoskin_emulator import program
from tomoskin_emulator.board_process import BoardIdentity


@pytest.fixture
def tomoskin(capfd):
    """Run a command: (exit code, stdout, stderr)."""

    def run(*words):
        with pytest.raises(SystemExit) as end:
            main(list(words))
        return int(end.value.code or 0), *capfd.readouterr()

    return run


@pytest.fixture
def mega():
    need(["avrdude"], "avrdude")
    with closing(Mega()) as mega:
        yield mega


def test_the_firmware_reads_what_configure_has_written(mega, tomoskin, programs, tmp_path):
    words = ("--current", "20 mA", "--id", "left-arm", "--skin", "textile-disc-8")
    code, out, err = tomoskin("firmware", "configure", mega.port, *words)
    assert (code, err) == (0, "")
    assert "20 mA, id left-arm (6c6566742d61726d), read back" in out
    assert "61.25 Ω" in out
    (tmp_path / "eeprom").write_bytes(mega.eeprom)
    options = ("-e", str(tmp_path / "eeprom"), str(programs.elf))
    with (
        running(programs.emulator, tmp_path / "port", *options) as board,
        closing(SerialTransport(board.path)) as transport,
    ):
        info = ask_info(transport)
    assert (info.current, info.unique_id) == (20_000, b"left-arm")


@pytest.mark.parametrize("bit", [0, 20, 70, 100])
def test_a_memory_with_one_wrong_bit_is_named_and_not_used(tomoskin, programs, tmp_path, bit):
    held = bytearray(BoardIdentity(0.01, b"left-arm").pack())
    held[bit // 8] ^= 1 << bit % 8
    (tmp_path / "eeprom").write_bytes(held)
    options = ("-e", str(tmp_path / "eeprom"), str(programs.elf))
    with running(programs.emulator, tmp_path / "port", *options) as board:
        with (
            pytest.raises(SourceError, match="damaged: its checksum"),
            Link(SerialTransport(board.path), SCAN, SETTINGS) as link,
        ):
            frames_of(link, 1)
        shown = tomoskin("firmware", "configure", board.path)[1]
        code, _, refused = tomoskin("firmware", "configure", board.path, "--id", "arm")
    assert "damaged" in shown
    assert (code, "--current too" in refused) == (2, True)


def test_what_is_not_named_stays_and_a_board_gets_an_id(mega, tomoskin):
    shown = tomoskin("firmware", "configure", mega.port)[1]
    assert "Arduino Mega 2560, 100 mA, id ffffffffffffffff" in shown
    assert tomoskin("firmware", "configure", mega.port, "--current", "50 mA")[0] == 0
    current, unique_id = struct.unpack_from("<I8s", mega.eeprom)
    assert current == 50_000
    assert unique_id != b"\xff" * 8
    assert tomoskin("firmware", "configure", mega.port, "--id", "arm")[0] == 0
    assert struct.unpack_from("<I8s", mega.eeprom) == (50_000, b"arm\0\0\0\0\0")


def test_an_eeprom_that_was_not_written_is_noticed(tomoskin):
    need(["avrdude"], "avrdude")
    with closing(Mega(oldest=True)) as mega:
        code, out, err = tomoskin("firmware", "configure", mega.port, "--current", "10 mA")
    assert (code, out) == (1, "")
    assert "wrote 10 mA" in err
    assert "reads 100 mA" in err
    assert "bootloader" in err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--current", "150 mA"), "100 mA, which is what the board's parts"),
        (("--current", "100 mA", "--skin", "tank-16"), "which is what the skin may"),
        (("--current", "0 A"), "1 µA"),
        (("--current", "12 ohm"), "unit of current"),
        (("--id", "much too long"), "1 to 8 ASCII"),
    ],
)
def test_a_current_that_may_not_be_is_refused_before_the_port_is_opened(tomoskin, words, said):
    code, out, err = tomoskin("firmware", "configure", "/dev/nowhere", *words)
    assert code in (1, 2)
    assert (out, "nowhere" in err) == ("", False)
    assert said in " ".join(err.replace("│", " ").split())


def test_an_installation_without_sources_flashes_its_image(mega, tomoskin, monkeypatch, tmp_path):
    need(["make", "avr-gcc"], "gcc-avr avr-libc")
    image = built("image", "tomoskin-16.hex")
    monkeypatch.setattr(program, "FOLDER", tmp_path / "none")
    monkeypatch.setattr(program, "IMAGES", image.parent)
    code, out, err = tomoskin("firmware", "flash", mega.port, "--channels", "16")
    assert (code, err) == (0, "")
    assert "16 channels" in out
    assert all(mega.flash[at] == byte for at, byte in _bytes_of(image).items())
    monkeypatch.setattr(program, "IMAGES", tmp_path)
    assert "holds no firmware" in tomoskin("firmware", "flash", mega.port)[2]


def test_a_port_that_is_not_there_is_said_at_once(tomoskin):
    need(["avrdude", "make", "avr-gcc"], "avrdude gcc-avr avr-libc")
    for command in ("flash", "configure"):
        code, _, err = tomoskin("firmware", command, "/dev/nowhere")
        assert (code, "no such port" in err) == (1, True)


def _bytes_of(image):
    """An Intel HEX file of one segment: each byte by its address."""
    found = {}
    for line in image.read_text().splitlines():
        record = bytes.fromhex(line[1:])
        if record[3] == 0:
            at = int.from_bytes(record[1:3], "big")
            found |= {at + n: byte for n, byte in enumerate(record[4:-1])}
    return found
