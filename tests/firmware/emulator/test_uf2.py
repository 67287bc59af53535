"""The Pico's image as a boot drive takes it, and what is refused."""

from __future__ import annotations

import struct
from pathlib import Path

import pytest
from typer.testing import CliRunner

from firmware.boards import FIRMWARE
from firmware.emulator.pico import boot_checksum, check_boot, powered
from tomoskin.cli.app import app
from tomoskin.core import SourceError
from tomoskin_emulator import write_uf2
from tomoskin_emulator.flash import find_boot_drive
from tomoskin_emulator.program import FLASH, PicoPrograms, pack_uf2

IMAGE = bytes(range(256)) * 2 + b"end"
ABOUT = "UF2 Bootloader v3.0\nModel: Raspberry Pi RP2\nBoard-ID: {}\n"


def drive(folder: Path, board: str = "RPI-RP2") -> Path:
    folder.mkdir(parents=True)
    (folder / "INFO_UF2.TXT").write_text(ABOUT.format(board), encoding="utf-8")
    return folder


def unpacked(data: bytes) -> dict[int, bytes]:
    """Pages of 256 bytes by address, as the RP2040's boot ROM takes a UF2."""
    assert len(data) % 512 == 0
    pages = {}
    for number, at in enumerate(range(0, len(data), 512)):
        first, second, flags, address, *rest = struct.unpack_from("<8I", data, at)
        assert (first, second, flags & 0x2000) == (0x0A324655, 0x9E5D5157, 0x2000)
        assert rest == [256, number, len(data) // 512, 0xE48BFF56]
        assert data[at + 508 : at + 512] == struct.pack("<I", 0x0AB16F30)
        pages[address] = data[at + 32 : at + 288]
    assert len(pages) == len(data) // 512
    return pages


def test_pages_come_back() -> None:
    pages = unpacked(pack_uf2(IMAGE))
    assert list(pages) == [FLASH, FLASH + 256, FLASH + 512]
    assert b"".join(pages.values()) == IMAGE.ljust(768, b"\0")


def test_the_checksum_is_the_boot_roms() -> None:
    assert boot_checksum(b"123456789") == 0x0376E6E7  # CRC-32/MPEG-2, of its catalogue


def test_the_real_image_would_start(pico: PicoPrograms) -> None:
    pages = unpacked(pico.image.read_bytes())
    check_boot(pages[FLASH])
    stack, start = struct.unpack_from("<2I", pages[FLASH + 256])
    assert stack == 0x20042000
    assert start % 2 == 1
    assert FLASH < start < FLASH + 0x400


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


def test_configure_writes_the_last_sector_and_the_firmware_reads_it(
    pico: PicoPrograms, tmp_path: Path
) -> None:
    boot = drive(tmp_path / "RPI-RP2")
    words = ["firmware", "configure", str(boot), "--board", "pico", "--current", "50 mA"]
    said = CliRunner().invoke(app, words).output
    assert "24.5 Ω" in said
    ((address, page),) = unpacked((boot / "tomoskin.uf2").read_bytes()).items()
    assert address == FLASH + 0x1FF000
    (settings := tmp_path / "settings").write_bytes(page)
    with powered(pico, tmp_path, "-f", "-e", str(settings)) as board:
        shown = CliRunner().invoke(app, ["firmware", "configure", board.board.port]).output
    assert "Raspberry Pi Pico, 50 mA, id emulated" in " ".join(shown.split())


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--current", "60 mA"), "50 mA, which is what the board's parts"),
        (("--id", "arm"), "its flash chip's, and cannot be changed"),
        ((), "expected --current"),
    ],
)
def test_what_a_pico_is_not_configured_with(
    words: tuple[str, ...], said: str, tmp_path: Path
) -> None:
    boot = drive(tmp_path / "RPI-RP2")
    done = CliRunner().invoke(app, ["firmware", "configure", str(boot), "--board", "pico", *words])
    assert done.exit_code
    assert said in " ".join(f"{done.output} {done.exception}".replace("│", " ").split())
    assert len(list(boot.iterdir())) == 1


def test_the_command_line_builds_and_flashes(pico: PicoPrograms, tmp_path: Path) -> None:
    said = CliRunner().invoke(app, ["firmware", "build", "--board", "pico", "--channels", "32"])
    assert Path(said.output.strip()) == pico.image
    boot = drive(tmp_path / "RPI-RP2")
    words = ["firmware", "flash", str(boot), "--board", "pico", "--channels", "32"]
    assert "the Raspberry Pi Pico starts it" in CliRunner().invoke(app, words).output
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
