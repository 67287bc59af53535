"""The Pico's image as a boot drive takes it, and what is refused."""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import CliRunner

from firmware.boards import FIRMWARE
from tomoskin.cli.app import app
from tomoskin.core import SourceError
from tomoskin.emulator import PicoPrograms, find_boot_drive, write_uf2
from tomoskin.emulator.uf2 import FLASH, boot_checksum, check_boot, pack_uf2, unpack_uf2

IMAGE = bytes(range(256)) * 2 + b"end"
ABOUT = "UF2 Bootloader v3.0\nModel: Raspberry Pi RP2\nBoard-ID: {}\n"


def drive(folder: Path, board: str = "RPI-RP2") -> Path:
    folder.mkdir(parents=True)
    (folder / "INFO_UF2.TXT").write_text(ABOUT.format(board), encoding="utf-8")
    return folder


def test_pages_come_back() -> None:
    pages = unpack_uf2(pack_uf2(IMAGE), "x")
    assert list(pages) == [FLASH, FLASH + 256, FLASH + 512]
    assert b"".join(pages.values()) == IMAGE.ljust(768, b"\0")


def test_the_checksum_is_the_boot_roms() -> None:
    assert boot_checksum(b"123456789") == 0x0376E6E7  # CRC-32/MPEG-2, of its catalogue
    with pytest.raises(SourceError, match=r"expected the checksum 0x.* correct the last word"):
        check_boot(IMAGE, "x")


def test_the_real_image_would_start(pico: PicoPrograms) -> None:
    pages = unpack_uf2(pico.image.read_bytes(), "x")
    check_boot(pages[FLASH], "x")
    stack, start = struct.unpack_from("<2I", pages[FLASH + 256])
    assert stack == 0x20042000
    assert start % 2 == 1
    assert FLASH < start < FLASH + 0x400


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (lambda data: data[:-1], "blocks of 512 bytes"),
        (lambda _: b"", "found 0 bytes"),
        (lambda data: b"X" + data[1:], "marks of UF2 at byte 0"),
        (lambda data: data[:28] + b"\x12\x34\x56\x78" + data[32:], "for another board"),
        (lambda data: data[:8] + b"\0\0\0\0" + data[12:], "found none"),
        (lambda data: data[:16] + b"\x80\0\0\0" + data[20:], "256 bytes in a block, found 128"),
    ],
)
def test_another_boards_file_is_refused(
    spoil: Callable[[bytes], bytes], said: str, tmp_path: Path
) -> None:
    with pytest.raises(SourceError, match=said):
        write_uf2(spoil(pack_uf2(IMAGE)), drive(tmp_path / "RPI-RP2"))
    assert len(list((tmp_path / "RPI-RP2").iterdir())) == 1


def test_only_a_picos_drive_is_written(tmp_path: Path) -> None:
    image = pack_uf2(IMAGE)
    with pytest.raises(SourceError, match="found SAMD21"):
        write_uf2(image, drive(tmp_path / "a" / "ARDUINO", "SAMD21"))
    with pytest.raises(
        SourceError, match=r"expected one boot drive of a Pico, found none.*BOOTSEL"
    ):
        find_boot_drive([tmp_path])
    right = drive(tmp_path / "a" / "RPI-RP2")
    assert find_boot_drive([tmp_path]) == right
    write_uf2(image, right)
    assert (right / "tomoskin.uf2").read_bytes() == image
    drive(tmp_path / "b")
    with pytest.raises(SourceError, match="expected one boot drive"):
        find_boot_drive([tmp_path])


def test_the_command_line_builds_and_flashes(pico: PicoPrograms, tmp_path: Path) -> None:
    said = CliRunner().invoke(app, ["firmware", "build", "--board", "pico", "--channels", "16"])
    assert Path(said.output.strip()) == pico.image
    boot = drive(tmp_path / "RPI-RP2")
    words = ["firmware", "flash", str(boot), "--board", "pico", "--channels", "16"]
    assert "the Pico starts it" in CliRunner().invoke(app, words).output
    assert (boot / "tomoskin.uf2").read_bytes() == pico.image.read_bytes()
    assert CliRunner().invoke(app, ["firmware", "build", "--board", "uno"]).exit_code == 2
    assert CliRunner().invoke(app, ["firmware", "flash"]).exit_code == 2


def test_pins_are_the_same_in_firmware_and_emulator() -> None:
    header = (FIRMWARE / "pico" / "pins.h").read_text(encoding="utf-8")
    front = (FIRMWARE / "pico" / "emulator" / "front.mjs").read_text(encoding="utf-8")
    for name in ("SOURCE_SHIFT", "SINK_SHIFT", "READ_SHIFT"):
        value = header.partition(f"#define {name} ")[2].partition("u")[0]
        assert f"const {name} = {value};" in front
    for name in ("SOURCE_ENABLE", "SINK_ENABLE", "LATCH"):
        value = header.partition(f"#define {name} (1u << ")[2].partition(")")[0]
        assert f"const {name} = {value};" in front
