"""Sciospec's ``.eit`` files, one frame each: a header, then for each injection a line of its two
channels and a line of potentials, real and imaginary part of every channel in turn.

The first line says how many lines the header has; ``MeasurementChannels`` names the channels that
are on electrodes, the line after it all that are in the file. The current enters at the first of
an injection's channels, whose potential is the highest. Voltages are differences of neighbouring
channels, without those that touch the injection.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import DataError, IntArray
from tomoskin.files.imports.tables import neighbours, scan_of, voltages_of
from tomoskin.files.imports.text_logs import numbers_in
from tomoskin.sensing.signal import Recording

_CHANNELS = "MeasurementChannels:"
_ALL = "MeasurementChannelsIndependentFromInjectionPattern:"


def detects(lines: list[str]) -> bool:
    """Whether there is such a header."""
    return any(line.startswith(_CHANNELS) for line in lines)


def parse(lines: Iterable[str], source: str) -> Recording:
    """Return the recording of one frame.

    Raises
    ------
    DataError
        When header or injections are not as expected, or there are several frequencies.
    """
    text = [line.strip() for line in lines]
    header = int(text[0]) if text and text[0].isdigit() else 0
    channels, all_channels = (_channels(text[:header], word, source) for word in (_CHANNELS, _ALL))
    number = {int(channel): index for index, channel in enumerate(channels)}
    body = [line for line in text[header:] if line]
    drives, potentials = [], []
    for line, values in zip(body[::2], body[1::2], strict=False):
        pair = [number.get(int(part), -1) for part in line.split() if part.isdigit()]
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
    return _recording(np.array(drives), np.array(potentials), source)


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


def _recording(drives: IntArray, potentials: NDArray[np.complex128], source: str) -> Recording:
    rows, kept = scan_of(drives, neighbours(potentials.shape[1]))
    values = potentials - np.roll(potentials, -1, axis=1)
    return voltages_of(source, values.reshape(1, -1)[:, kept], rows)
