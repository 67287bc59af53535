"""What happens to files and texts on their way: the same damage for the same number."""

from __future__ import annotations

import io
import random
import re
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

_BLOCK = 64
_NUMBERS = (b"nan", b"-1", b"0", b"1e999", b"1e-300", b"1e300", b'"x"', b"[]", b"99999999999")


def mutated(data: bytes, number: int, *, text: bool = False) -> bytes:
    """``data`` with one to three faults: the same for the same number."""
    rng = random.Random(number)
    faults = _TEXT_FAULTS if text and number % 2 else _FAULTS
    for _ in range(rng.choice((1, 1, 2, 3))):
        if data:
            data = rng.choice(faults)(data, rng.randrange(len(data)), rng)
    return data


def remade(arrays: Mapping[str, NDArray[Any]], number: int) -> bytes:
    """An undamaged .npz of ``arrays`` of which one is not what it ought to be."""
    rng = random.Random(number)
    changed = dict(arrays)
    name = rng.choice(sorted(changed))
    file = io.BytesIO()
    with np.errstate(all="ignore"):
        value = rng.choice(_ARRAY_FAULTS)(np.asarray(changed.pop(name)))
        if value is not None:
            changed[name] = value
        np.savez(file, **changed)  # type: ignore[arg-type]
    return file.getvalue()


def _times(factor: float) -> Callable[[NDArray[Any]], NDArray[Any]]:
    return lambda value: value * factor if value.dtype.kind in "fiu" else value[..., None]


_ARRAY_FAULTS: tuple[Callable[[NDArray[Any]], NDArray[Any] | None], ...] = (
    lambda _: None,
    lambda value: value.T,
    lambda value: value.ravel(),
    lambda value: np.atleast_1d(value)[:-1],
    lambda value: np.atleast_1d(value)[:0],
    lambda value: np.repeat(np.atleast_1d(value), 2, axis=0),
    lambda value: value[None],
    lambda value: value.astype(str),
    *(lambda value, c=c: np.full(value.shape, c) for c in (np.nan, 0.0, 1 + 1j, True)),
    *map(_times, (1e300, 1e-300, -1.0, 0.5)),
)


def _other_number(data: bytes, at: int, rng: random.Random) -> bytes:
    spans = [match.span() for match in re.finditer(rb"\d[\d.e+-]*", data)]
    start, end = rng.choice(spans or [(at, at + 1)])
    return data[:start] + rng.choice(_NUMBERS) + data[end:]


def _other_lines(data: bytes, _: int, rng: random.Random) -> bytes:
    """Without one of its lines, or with one of them twice."""
    lines = data.splitlines(keepends=True)
    k = rng.randrange(len(lines))
    return b"".join([*lines[:k], *rng.choice(([], 2 * [lines[k]])), *lines[k + 1 :]])


Fault = Callable[[bytes, int, random.Random], bytes]
_FAULTS: tuple[Fault, ...] = (
    lambda d, at, r: d[:at] + bytes([d[at] ^ 1 << r.randrange(8)]) + d[at + 1 :],
    lambda d, at, _: d[:at],
    lambda d, at, r: d[:at] + d[at + r.randint(1, _BLOCK) :],
    lambda d, at, r: d[:at] + r.randbytes(r.randint(1, _BLOCK)) + d[at:],
    lambda d, at, r: d[:at] + d[at : at + r.randint(1, 4 * _BLOCK)] + d[at:],
    lambda d, at, r: d[:at] + r.choice((b"\0", b"\x7f", b"\xff")) * 4 + d[at + 4 :],
    lambda d, at, r: d[: at % 400] + r.randbytes(1) + d[at % 400 + 1 :],
)
"""A bit turned, an end lost, a piece lost, put in or repeated, bytes filled, one at the head."""

_TEXT_FAULTS: tuple[Fault, ...] = (_other_number, _other_lines)
