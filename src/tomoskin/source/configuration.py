"""A scan as the commands that set it on a board."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

from tomoskin.pattern import Scan
from tomoskin.source.settings import ScanSettings, scan_time
from tomoskin.wire import SCHEMA, Command, Drive, SetPattern, SetScan, Start, crc16, encode_payload


@dataclass(frozen=True)
class Configuration:
    """Identity and commands; request ids are filled in when a command is sent.

    The identity is a checksum of the commands, never 0: the same scan has the same identity
    on every host, and frames of another scan are told apart.
    """

    identity: int
    commands: tuple[Command, ...]
    n_samples: int
    scan_time: float

    @classmethod
    def of(cls, scan: Scan, settings: ScanSettings) -> Self:
        """Timing, drives in chunks, and START."""
        announce = SetScan(
            request=0,
            configuration=0,
            n_drives=len(scan.drives),
            settling=round(settings.settling * 1e6),
            dead_time=round(settings.dead_time * 1e6),
            oversampling=settings.oversampling,
            prescaler=settings.prescaler,
            current_limit=round(settings.current_limit * 1e6),
        )
        chunks = _chunks(scan)
        content = encode_payload(announce) + b"".join(encode_payload(chunk) for chunk in chunks)
        identity = crc16(content) or 1
        return cls(
            identity,
            (
                replace(announce, configuration=identity),
                *(replace(chunk, configuration=identity) for chunk in chunks),
                Start(0, identity),
            ),
            scan.n_samples,
            scan_time(
                len(scan.drives),
                scan.n_samples * settings.oversampling,
                settings.settling + settings.dead_time,
                settings.prescaler,
            ),
        )


def _chunks(scan: Scan) -> list[SetPattern]:
    drives = [
        Drive(source, sink, mask)
        for (source, sink), mask in zip(scan.drives.tolist(), scan.masks.tolist(), strict=True)
    ]
    empty = len(encode_payload(SetPattern(0, 0, 0, ())))
    size = len(encode_payload(SetPattern(0, 0, 0, (Drive(0, 0, 0),)))) - empty
    most = (SCHEMA.to_device_bytes - 2 - empty) // size
    return [
        SetPattern(0, 0, first, tuple(drives[first : first + most]))
        for first in range(0, len(drives), most)
    ]
