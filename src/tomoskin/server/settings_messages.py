"""Messages to a page about the skin's settings and the twin; see ``server/page_messages.py``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

from tomoskin.server.page_messages import Message, MessagePart
from tomoskin.server.requests import Value


class KindForm(MessagePart, frozen=True, omit_defaults=True):
    """What a value may be, for a form; ``names`` and ``inner`` are of the columns of rows."""

    form: Literal["choice", "number", "quantity", "rows", "text"]
    words: tuple[str, ...] | None = None
    low: float | None = None
    high: float | None = None
    unit: str | None = None
    names: tuple[str, ...] | None = None
    inner: KindForm | None = None


class Condition(MessagePart, frozen=True):
    """One of these ``words`` as the value of another key."""

    key: str
    words: tuple[str, ...]


class KeyForm(MessagePart, frozen=True):
    """One key of a section.

    ``expected``: what a value must be, in words; ``when``: beside what it may stand;
    ``effective``: with what it does anything; ``unless``: the key that it may not stand beside.
    """

    name: str
    kind: KindForm
    expected: str
    meaning: str
    required: bool
    when: Condition | None
    effective: Condition | None
    unless: str | None
    locked: bool


class SectionForm(MessagePart, frozen=True):
    """The form of one section of a skin file."""

    name: str
    meaning: str
    keys: list[KeyForm]


class SchemaForm(Message, frozen=True, tag="schema"):
    """Every section and key of a skin file."""

    sections: list[SectionForm]


class Settings(Message, frozen=True, tag="settings"):
    """The skin's settings by section; ``took_ms``: how long the last change took."""

    document: Mapping[str, Mapping[str, Value]]
    n_electrodes: int
    automatic_alpha: float | None
    alpha: float
    undo: int
    redo: int
    busy: bool
    took_ms: float | None
    files: list[str]
    builtin: tuple[str, ...]


StageName = Literal["mesh", "model", "image", "touches", "source"]


class Progress(Message, frozen=True, tag="progress"):
    """How far a change has come: ``done`` of ``stages``; ``stage`` null: before the first."""

    stage: StageName | None
    done: int
    stages: int


class SettingRefused(Message, frozen=True, tag="settings_error"):
    """A setting was refused; section and key where the error names them."""

    section: str | None
    key: str | None
    message: str


class PatternTable(Message, frozen=True, tag="pattern"):
    """The measurements of a named pattern, to be edited."""

    name: str
    drive: list[tuple[int, int]]
    measure: list[tuple[int, int]]


# The twin.


class TwinBend(MessagePart, frozen=True):
    """By ``angle`` rad, over a strip of ``length`` along ``axis``, rad from x, ``offset`` m off."""

    angle: float
    axis: float
    length: float
    offset: float


class TwinStretch(MessagePart, frozen=True):
    """Relative elongations along ``axis``, rad from x, and across it."""

    along: float
    across: float
    axis: float


class TwinState(Message, frozen=True, tag="twin"):
    """What is wrong with the twin, and how it is bent; ``noise`` LSB, null: its own.

    ``bends``: along a strip, or at the joint that it lies on; ``size_m``: its largest extent.
    """

    breakable: bool
    cut: list[int]
    noise: float | None
    bendable: bool
    bends: Literal["hinge", "joint"] | None
    bend: TwinBend | None
    stretch: TwinStretch | None
    size_m: float


class TwinRefused(Message, frozen=True, tag="twin_refused"):
    """The twin cannot be bent in this way."""

    message: str


SETTINGS_MESSAGES = (
    *(SchemaForm, Settings, Progress, SettingRefused, PatternTable),
    *(TwinState, TwinRefused),
)
