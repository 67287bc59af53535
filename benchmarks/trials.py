"""Many attempts in a process of their own: what was refused, accepted, raised, or never ended."""

from __future__ import annotations

import contextlib
import io
import multiprocessing
import os
import random
import re
import resource
import signal
import traceback
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import TomoskinError

HANG = 10.0
"""Seconds after which an attempt has failed."""

MEMORY = 1 << 30
"""Bytes that an attempt may make a process hold."""

_BLOCK = 64
_NUMBERS = (b"nan", b"-1", b"0", b"1e999", b"1e-300", b"1e300", b'"x"', b"[]", b"99999999999")

Judge = Callable[[int], str]
"""Number of an attempt → "" where it was accepted, "wrong: …" where it ought not to have been.

What is refused raises TomoskinError.
"""


@dataclass
class Tally:
    """What became of the attempts of one kind, and one example of each fault."""

    kind: str
    counts: Counter[str] = field(default_factory=Counter)
    examples: dict[str, str] = field(default_factory=dict)

    def add(self, verdict: str, number: int, text: str = "") -> None:
        """One attempt more."""
        self.counts[verdict] += 1
        if text:
            self.examples.setdefault(verdict, f"{self.kind} {number}: {text}")


def attempt(kind: str, count: int, judge: Judge) -> Tally:
    """Judge attempts 0 … ``count`` − 1 in a process that may hang, grow and die."""
    tally, following = Tally(kind), 0
    context = multiprocessing.get_context("fork")
    while following < count:
        ours, theirs = context.Pipe()
        process = context.Process(target=_work, args=(theirs, judge, following, count))
        process.start()
        theirs.close()
        following = _watch(ours, tally, following, count)
        if process.is_alive():
            os.kill(process.pid or 0, signal.SIGKILL)
        process.join()
    return tally


def _watch(news: Connection, tally: Tally, following: int, count: int) -> int:
    """Count what the process says until it is to be given up; the attempt to go on with."""
    while following < count:
        if not news.poll(HANG):
            tally.add("hang", following, f"no answer in {HANG:g} s")
            return following + 1
        try:
            verdict, text, peak = news.recv()
        except EOFError:
            tally.add("traceback", following, "the process has died")
            return following + 1
        tally.add(verdict, following, text)
        following += 1
        if peak > MEMORY:
            tally.add("memory", following - 1, f"{peak / 2**20:.0f} MB")
            return following
    return following


def _work(news: Connection, judge: Judge, following: int, count: int) -> None:
    with Path(os.devnull).open("w") as nothing, contextlib.redirect_stderr(nothing):
        for number in range(following, count):
            verdict, text = _verdict(judge, number)
            news.send((verdict, text, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss << 10))


def _verdict(judge: Judge, number: int) -> tuple[str, str]:
    try:
        wrong = judge(number)
    except TomoskinError:
        return "refused", ""
    except Exception as error:
        frame = traceback.extract_tb(error.__traceback__)[-1]
        place = f"{Path(frame.filename).name}:{frame.lineno}"
        return "traceback", f"{type(error).__name__}: {error} ({place})"
    return ("wrong", wrong) if wrong else ("accepted", "")


def mutated(data: bytes, number: int, *, text: bool = False) -> bytes:
    """``data`` with one to three faults: the same for the same number."""
    rng = random.Random(number)
    faults = _TEXT_FAULTS if text and number % 2 else _FAULTS
    for _ in range(rng.choice((1, 1, 2, 3))):
        if data:
            data = rng.choice(faults)(data, rng)
    return data


def remade(arrays: Mapping[str, NDArray[Any]], number: int) -> bytes:
    """An undamaged .npz of ``arrays`` of which one is not what it ought to be."""
    rng = random.Random(number)
    changed = dict(arrays)
    name = rng.choice(sorted(changed))
    value = rng.choice(_ARRAY_FAULTS)(np.asarray(changed.pop(name)))
    if value is not None:
        changed[name] = value
    file = io.BytesIO()
    with np.errstate(all="ignore"):
        np.savez(file, **changed)  # type: ignore[arg-type]
    return file.getvalue()


def _times(factor: float) -> Callable[[NDArray[Any]], NDArray[Any]]:
    def scaled(value: NDArray[Any]) -> NDArray[Any]:
        with np.errstate(all="ignore"):
            return value * factor if value.dtype.kind in "fiu" else value[..., None]

    return scaled


_ARRAY_FAULTS: tuple[Callable[[NDArray[Any]], NDArray[Any] | None], ...] = (
    lambda _: None,
    lambda value: value.T,
    lambda value: value.ravel(),
    lambda value: np.atleast_1d(value)[:-1],
    lambda value: np.atleast_1d(value)[:0],
    lambda value: np.repeat(np.atleast_1d(value), 2, axis=0),
    lambda value: value[None],
    lambda value: value.astype(str),
    lambda value: np.full(value.shape, np.nan),
    lambda value: np.zeros(value.shape),
    lambda value: np.full(value.shape, 1 + 1j),
    lambda value: np.full(value.shape, True),
    _times(1e300),
    _times(1e-300),
    _times(-1.0),
    _times(0.5),
)


def _flipped(data: bytes, rng: random.Random) -> bytes:
    at = rng.randrange(len(data))
    return data[:at] + bytes([data[at] ^ 1 << rng.randrange(8)]) + data[at + 1 :]


def _cut(data: bytes, rng: random.Random) -> bytes:
    return data[: rng.randrange(len(data))]


def _removed(data: bytes, rng: random.Random) -> bytes:
    at = rng.randrange(len(data))
    return data[:at] + data[at + rng.randint(1, _BLOCK) :]


def _inserted(data: bytes, rng: random.Random) -> bytes:
    at = rng.randrange(len(data))
    return data[:at] + rng.randbytes(rng.randint(1, _BLOCK)) + data[at:]


def _repeated(data: bytes, rng: random.Random) -> bytes:
    at = rng.randrange(len(data))
    return data[:at] + data[at : at + rng.randint(1, 4 * _BLOCK)] + data[at:]


def _filled(data: bytes, rng: random.Random) -> bytes:
    at, size = rng.randrange(len(data)), rng.choice((1, 2, 4, 8))
    return data[:at] + bytes([rng.choice((0, 0x7F, 0xFF))]) * size + data[at + size :]


def _at_the_head(data: bytes, rng: random.Random) -> bytes:
    at = rng.randrange(min(len(data), 400))
    return data[:at] + rng.randbytes(1) + data[at + 1 :]


def _other_number(data: bytes, rng: random.Random) -> bytes:
    spans = [match.span() for match in re.finditer(rb"\d[\d.e+-]*", data)]
    if not spans:
        return _flipped(data, rng)
    start, end = rng.choice(spans)
    return data[:start] + rng.choice(_NUMBERS) + data[end:]


def _without_a_line(data: bytes, rng: random.Random) -> bytes:
    lines = data.splitlines(keepends=True)
    del lines[rng.randrange(len(lines))]
    return b"".join(lines)


def _twice_a_line(data: bytes, rng: random.Random) -> bytes:
    lines = data.splitlines(keepends=True)
    at = rng.randrange(len(lines))
    return b"".join([*lines[:at], lines[at], *lines[at:]])


_FAULTS = (_flipped, _cut, _removed, _inserted, _repeated, _filled, _at_the_head)
_TEXT_FAULTS = (_other_number, _other_number, _without_a_line, _twice_a_line)
