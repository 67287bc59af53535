"""UF2, the form in which a Pico takes its firmware: blocks of 256 bytes for its boot drive."""

from __future__ import annotations

import struct

from tomoskin.core import SourceError

RP2040 = 0xE48BFF56
"""The family that the RP2040's boot ROM asks for."""

FLASH = 0x10000000
"""Where the flash lies in the RP2040's address space."""

_HEAD = struct.Struct("<8I")
_MAGIC = (0x0A324655, 0x9E5D5157)
_END = struct.pack("<I", 0x0AB16F30)
_HAS_FAMILY = 0x2000
_BLOCK = 512
PAGE = 256
"""Bytes of flash in a block."""

_STAGE = 252
"""Bytes of the boot's second stage; its checksum follows."""


def pack_uf2(image: bytes, address: int = FLASH) -> bytes:
    """The UF2 that puts ``image`` at ``address``."""
    pages = [image[at : at + PAGE] for at in range(0, len(image), PAGE)]
    return b"".join(
        _HEAD.pack(*_MAGIC, _HAS_FAMILY, address + PAGE * k, PAGE, k, len(pages), RP2040)
        + page.ljust(_BLOCK - _HEAD.size - len(_END), b"\0")
        + _END
        for k, page in enumerate(pages)
    )


def unpack_uf2(data: bytes, where: str) -> dict[int, bytes]:
    """Pages of 256 bytes by address. Raises SourceError for what a Pico would not take."""
    if not data or len(data) % _BLOCK:
        raise _bad(where, f"expected blocks of {_BLOCK} bytes, found {len(data)} bytes")
    pages: dict[int, bytes] = {}
    numbers, total = set(), 0
    for at in range(0, len(data), _BLOCK):
        first, second, flags, address, size, number, total, family = _HEAD.unpack_from(data, at)
        if (first, second) != _MAGIC or data[at + _BLOCK - 4 : at + _BLOCK] != _END:
            raise _bad(where, f"expected the marks of UF2 at byte {at}, found others")
        if not flags & _HAS_FAMILY or family != RP2040:
            found = f"{family:08x}" if flags & _HAS_FAMILY else "none"
            raise SourceError(
                f"expected firmware of the family {RP2040:08x} (RP2040), found {found}",
                where=where,
                hint="this UF2 is for another board: tomoskin firmware build --board pico",
            )
        if size != PAGE:
            raise _bad(where, f"expected {PAGE} bytes in a block, found {size}")
        if number in numbers or address in pages:
            raise _bad(where, f"expected each block once, found block {number} again")
        numbers.add(number)
        pages[address] = data[at + _HEAD.size : at + _HEAD.size + PAGE]
    missing = sorted(set(range(total)) - numbers)
    if missing or len(numbers) > total:
        what = f"block {missing[0]} is missing" if missing else "it says fewer"
        raise _bad(where, f"expected {total} blocks, found {len(numbers)}: {what}")
    return pages


def check_boot(image: bytes, where: str) -> None:
    """Raise SourceError unless the boot ROM would run ``image``: it checks the second stage."""
    expected = boot_checksum(image[:_STAGE])
    (found,) = struct.unpack_from("<I", image, _STAGE)
    if found != expected:
        raise SourceError(
            f"expected the checksum 0x{expected:08X} of the boot's second stage, "
            f"found 0x{found:08X}",
            where=where,
            hint="a Pico would not start: correct the last word of firmware/pico/boot2.S",
        )


def boot_checksum(stage: bytes) -> int:
    """CRC-32 as the boot ROM has it: 0x04C11DB7, not reflected, from 0xFFFFFFFF."""
    crc = 0xFFFFFFFF
    for byte in stage:
        crc ^= byte << 24
        for _ in range(8):
            crc = (crc << 1 ^ (0x04C11DB7 if crc >> 31 else 0)) & 0xFFFFFFFF
    return crc


def _bad(where: str, what: str) -> SourceError:
    return SourceError(f"no UF2: {what}", where=where, hint="build it again")
