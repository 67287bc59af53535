"""Sciospec's ``.eit`` files, of any version of its program."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import DataError, IntArray
from tomoskin.extras.instruments import tables
from tomoskin.extras.instruments.text_logs import numbers_in
from tomoskin.files.imports import voltages_of
from tomoskin.sensing.signal import Recording

_CHANNELS = "MeasurementChannels:"
_ALL = "MeasurementChannelsIndependentFromInjectionPattern:"


_HEADERS = range(6, 41)
"""Lines of a header: 11 in 2020, 13 and more since."""

_FEWEST = 4
"""Channels of a frame."""


def is_sciospec(lines: list[str]) -> bool:
    """Whether there is such a header: by its names, or by what stands behind so many lines as the
    first one says."""
    if any(line.startswith(_CHANNELS) for line in lines):
        return True
    header = _header(lines)
    if not header or len(lines) < header + 2:
        return False
    values = numbers_in(lines[header + 1], "\t") or ()
    is_frame = len(values) >= 2 * _FEWEST and len(values) % 2 == 0
    return is_frame and len(_pair(lines[header])) == 2


def _header(lines: list[str]) -> int:
    """Lines of the header, as the first one says; 0 where it says none."""
    first = lines[0].strip().removeprefix("\ufeff") if lines else ""
    return int(first) if first.isdecimal() and int(first) in _HEADERS else 0


def _pair(line: str) -> list[int]:
    """Channels, from 1, on the line that begins an injection."""
    words = line.split()
    return [int(word) for word in words] if all(word.isdecimal() for word in words) else []


def read_sciospec(lines: Iterable[str], source: str) -> Recording:
    """Sciospec's ``.eit`` files, one frame each: a header, then for each injection a line of its
    two channels and a line of potentials, real and imaginary part of every channel in turn.

    The first line says how many lines the header has; ``MeasurementChannels`` names the channels
    that are on electrodes, the line after it all that are in the file. Programs of 2020 write
    neither: all channels are in the file, and those that are driven are on electrodes. The current
    enters at the first of an injection's channels, whose potential is the highest. Voltages are
    differences of neighbouring channels, without those that touch the injection.

    Raises
    ------
    DataError
        When header or injections are not as expected, or there are several frequencies.
    """
    text = [line.strip() for line in lines]
    header = _header(text)
    body = [line for line in text[header:] if line]
    if any(line.startswith(_CHANNELS) for line in text):
        channels = all_channels = _channels(text[:header], _CHANNELS, source)
        if any(line.startswith(_ALL) for line in text):
            all_channels = _channels(text[:header], _ALL, source)
    else:
        channels, all_channels = _driven(body)
    number = {int(channel): index for index, channel in enumerate(channels)}
    drives, potentials = [], []
    for line, values in zip(body[::2], body[1::2], strict=False):
        pair = [number.get(channel, -1) for channel in _pair(line)]
        if len(pair) != 2 or min(pair) < 0:
            raise DataError(
                f"expected an injection's two channels, each of MeasurementChannels, got "
                f'"{line[:40]}"',
                where=source,
                hint="one frame of one frequency can be read",
            )
        drives.append(pair)
        potentials.append(_potentials(values, channels, all_channels, source))
    if not drives:
        raise DataError("holds no injection", where=source)
    return _of_injections(np.array(drives), np.array(potentials), source)


def _channels(header: list[str], word: str, source: str) -> NDArray[np.int64]:
    """Numbers of channels, from 1."""
    for line in header:
        if line.startswith(word):
            numbers = numbers_in(line.removeprefix(word))
            if numbers:
                return np.array(numbers, dtype=np.int64)
    raise DataError(
        f"expected numbers of channels after {word} in the header, got none", where=source
    )


def _driven(body: list[str]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Those that some injection uses, and all, of a file whose header names none."""
    driven = sorted({channel for line in body[::2] for channel in _pair(line)})
    values = numbers_in(body[1], "\t") or () if len(body) > 1 else ()
    return np.array(driven, dtype=np.int64), 1 + np.arange(len(values) // 2, dtype=np.int64)


def _potentials(
    line: str, channels: NDArray[np.int64], all_channels: NDArray[np.int64], source: str
) -> NDArray[np.complex128]:
    """(n,) V of the ``channels``, from a line of these or of all."""
    values = numbers_in(line, "\t")
    parts = np.array(values or (), dtype=np.float64)
    for listed in (channels, all_channels):
        if len(parts) == 2 * len(listed):
            by_channel = dict(zip(listed.tolist(), parts[::2] + 1j * parts[1::2], strict=True))
            return np.array([by_channel[channel] for channel in channels.tolist()])
    raise DataError(
        f"expected {2 * len(channels)} or {2 * len(all_channels)} numbers for an injection, got "
        f"{len(parts)}",
        where=source,
    )


def _of_injections(drives: IntArray, potentials: NDArray[np.complex128], source: str) -> Recording:
    rows, kept = tables.scan_of(drives, tables.neighbours(potentials.shape[1]))
    values = potentials - np.roll(potentials, -1, axis=1)
    return voltages_of(source, values.reshape(1, -1)[:, kept], rows)
