"""One frame of a session on its way from counts to touches: what each step made, and why.

The session is replayed, and the steps of the pipeline show their records as the frame passes. So
what is told is what a run does; nothing here computes anything of a frame.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass
from functools import cache
from itertools import groupby
from typing import Any

import numpy as np

from tomoskin.core import DataError, observe_steps
from tomoskin.files.session.replayed import as_recorded, gathered, replaying
from tomoskin.files.session.session_reader import SessionReader
from tomoskin.pipeline import FrameResult

_UNTOLD = {"cells", "mesh_id"}
"""Fields that tell a person nothing."""

_LONG = 100
"""Characters of a field's meaning that are shown."""


@dataclass(frozen=True)
class FrameStep:
    """What one ``name``-d step has made: the ``record`` itself, and ``lines`` that describe it."""

    name: str
    record: object

    @property
    def lines(self) -> list[str]:
        """The record in words: each field with its shape, range and meaning."""
        return list(described(self.record))


@dataclass(frozen=True)
class Explanation:
    """The way of one frame.

    Attributes
    ----------
    frame
        Its number in the recording.
    time
        When it was scanned, s of the recording's clock.
    steps
        In their order.
    result
        What came out; None where the run held, skipped or refused the frame.
    """

    frame: int
    time: float
    steps: tuple[FrameStep, ...]
    result: FrameResult | None

    def of_touch(self, touch: int) -> tuple[str, ...]:
        """Why the touch of that identity is as it is in this frame, a sentence each."""
        made = (step.record for step in self.steps if step.name == "decision")
        return tuple(sentence(one) for one in made if getattr(one, "touch", None) == touch)

    @property
    def lines(self) -> Iterator[str]:
        """All of it, for people."""
        yield f"frame {self.frame}, {self.time:.3f} s"
        for name, steps in groupby(self.steps, key=lambda step: step.name):
            yield f"{name}:"
            yield from (f"  {line}" for step in steps for line in step.lines)
        if self.result is None:
            yield "the run held, skipped or refused this frame: nothing was made of it"
        elif self.result.problem:
            yield f"problem: {self.result.problem}"


def explain(session: SessionReader, frame: int) -> Explanation:
    """The way of a ``frame`` of ``session``, by its number in the recording.

    All frames before it are replayed first, since a frame is judged by what came before.

    Raises
    ------
    DataError
        When the session cannot be replayed, or has no such frame.
    """
    prepared = as_recorded(session)
    steps: list[FrameStep] = []

    def note(name: str, record: object) -> None:
        steps.append(FrameStep(name, record))

    last = -1
    with observe_steps(note):
        frames = gathered(replaying(prepared, session), session, prepared.scan)
        while (one := next(frames, None)) is not None:
            scanned, result = one
            last = scanned.number
            if last == frame:
                return Explanation(frame, scanned.time, tuple(steps), result)
            steps.clear()
    raise DataError(
        f"expected a frame from 0 to {last}, got {frame}",
        where=str(session.path),
        hint="tomoskin session info says how many there are",
    )


def described(record: object, meaning: str = "") -> Iterator[str]:
    """A record in lines: arrays by shape and range, records by their fields."""
    if is_dataclass(record) and not isinstance(record, type):
        if hasattr(record, "why"):
            yield sentence(record)
            return
        meaning_of = meanings(type(record))
        for one in fields(record):
            if one.name not in _UNTOLD and not one.name.startswith("_"):
                yield from _field(one.name, getattr(record, one.name), meaning_of.get(one.name, ""))
    elif isinstance(record, Mapping):
        for name, value in record.items():
            yield from _field(str(name), value, "")
    elif isinstance(record, Sequence) and not isinstance(record, str):
        yield from _listed(record)
    else:
        yield value_of(record) + (f"   {meaning}" if meaning else "")


def sentence(decision: Any) -> str:
    """A decision as one sentence."""
    who = "a detection" if decision.touch is None else f"touch {decision.touch}"
    where = f"({1e3 * decision.x:+.1f}, {1e3 * decision.y:+.1f}) mm"
    return f"{who} at {where} {decision.what}: {decision.why}"


def value_of(value: object) -> str:
    """A value in short: of an array its shape, and what it ranges over."""
    match value:
        case np.ndarray() if value.dtype == bool:
            return f"{value.shape} bool, {np.count_nonzero(value)} of {value.size}"
        case np.ndarray() if value.size and value.dtype.kind in "iuf":
            low, high = np.nanmin(value), np.nanmax(value)
            return f"{value.shape} {value.dtype}, {low:.4g} to {high:.4g}"
        case np.ndarray():
            return f"{value.shape} {value.dtype}"
        case float():
            return "not known" if math.isnan(value) else f"{value:.6g}"
        case _:
            return str(value)


@cache
def meanings(kind: type) -> Mapping[str, str]:
    """What the fields of a record are, by its docstring: units, shapes."""
    meaning_of: dict[str, str] = {}
    names, text = list[str](), list[str]()
    section = (kind.__doc__ or "").partition("Attributes\n")[2]
    for line in [*section.splitlines(), "    end"]:
        heading = re.fullmatch(r"    ([a-z_]\w*(?:, [a-z_]\w*)*)", line)
        if heading:
            meaning = " ".join(text)
            short = meaning if len(meaning) <= _LONG else meaning[:_LONG].rpartition(" ")[0] + " …"
            meaning_of |= dict.fromkeys(names, short)
            names, text = heading[1].split(", "), []
        elif line.startswith("        "):
            text.append(line.strip())
    return meaning_of


def _field(name: str, value: object, meaning: str) -> Iterator[str]:
    nested = is_dataclass(value) or (isinstance(value, Sequence) and not isinstance(value, str))
    if not nested or isinstance(value, type):
        yield f"{name} = {value_of(value)}" + (f"   # {meaning}" if meaning else "")
        return
    inner = list(described(value))
    if len(inner) == 1:
        yield f"{name}: {inner[0]}"
    else:
        yield f"{name}:" + (f"   # {meaning}" if meaning else "")
        yield from (f"  {line}" for line in inner)


def _listed(records: Iterable[object]) -> Iterator[str]:
    """One record a line where its fields are plain values."""
    empty = True
    for number, record in enumerate(records):
        empty = False
        lines = [line.partition("   # ")[0] for line in described(record)]
        if any(line.endswith(":") for line in lines):
            yield f"{number}:"
            yield from (f"  {line}" for line in lines)
        else:
            yield f"{number}: {', '.join(lines)}"
    if empty:
        yield "none"
