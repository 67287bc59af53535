"""The text messages to a page, declared once: ``scripts/page_types.py`` makes the page's types of
them, of those about settings (``server/settings_messages.py``), of the requests
(``server/requests.py``) and of the frame (``server/frames.py``).

Lengths are m, times s. Coordinates lie flat as x0, y0, x1, y1, …; electrodes, points and presses
are counted from 0, labels from E1. What is not finite goes out as null.
"""

from __future__ import annotations

from typing import Any, Literal, Self

import msgspec

from tomoskin.core import encode_json
from tomoskin.run import ReplayStatus
from tomoskin.run.sinks import SinkReport
from tomoskin.sensing.signal import ElectrodeHealth
from tomoskin.sensing.track import Span
from tomoskin.server.requests import Unit

Point = tuple[float, float]
Flat = list[float]


class MessagePart(msgspec.Struct, frozen=True, kw_only=True):
    """A part of one of the messages to a page."""

    @classmethod
    def of(cls, item: object, **more: Any) -> Self:
        """The part that says of ``item`` what its own attributes say, and ``more``."""
        own = {n: getattr(item, n) for n in cls.__struct_fields__ if n not in more}
        return cls(**own, **more)


class Message(MessagePart, frozen=True, kw_only=True):
    """A message that the server sends to a page."""

    @property
    def json(self) -> str:
        """The message as the text that is sent."""
        return encode_json(self).decode()


# The skin, and how the run is doing.


class SkinName(MessagePart, frozen=True):
    """The skin, by what its file says."""

    name: str
    description: str
    source: str


class Electrode(MessagePart, frozen=True):
    """An electrode: its centre, its name, and the mesh points along its arc."""

    x: float
    y: float
    label: str
    points: list[int]


class PatternRows(MessagePart, frozen=True):
    """Source, sink and plus, minus of each measurement, flat."""

    name: str
    n_meas: int
    n_drive: int
    drive: list[int]
    measure: list[int]


class ProbeSizes(MessagePart, frozen=True):
    """What a press from the page is at first, and at most."""

    radius_m: float
    force_n: float
    max_force_n: float


class SamePlaces(MessagePart, frozen=True):
    """Places that the pattern cannot tell apart.

    ``maps``: each takes x, y (m) to a·x + b·y + e, c·x + d·y + f, as [a, b, c, d, e, f]; what comes
    to lie nearer than ``least_m`` to where it was is no other place. ``text`` says it in words.
    """

    text: str
    maps: list[Flat]
    least_m: float


class Scene(Message, frozen=True, tag="scene"):
    """Everything about the skin that does not change from frame to frame.

    ``limit`` is the end of the fixed symmetric colour scale, in ``unit``; ``solid`` holds the
    points in space, x0, y0, z0, …, of a sheet on a surface; null: the sheet lies flat.
    ``truth``: what really presses is known, because it can be pressed or was when it was recorded.
    ``same``: places that the pattern cannot tell apart; null: it tells all.
    """

    skin: SkinName
    unit: str
    limit: float
    points: Flat
    solid: Flat | None
    cells: list[int]
    outline: Flat
    electrodes: list[Electrode]
    pattern: PatternRows
    source: str
    pressable: bool
    truth: bool
    probe: ProbeSizes
    version: str
    same: SamePlaces | None = None


class Scale(Message, frozen=True, tag="scale"):
    """Another scale of the same scene."""

    limit: float
    unit: str


class ReferenceNow(MessagePart, frozen=True):
    """How far the reference is, and how old it has become."""

    frames: int
    needed: int
    age_s: float | None
    ready: bool


class BaselineNow(MessagePart, frozen=True):
    """Drift since the reference as a part of it, how long it is held, and why it is stale."""

    drift: float | None
    held_s: float
    noise_v: float | None
    stale: str | None


class StageNow(MessagePart, frozen=True):
    """How long one stage of the frame flow takes."""

    name: str
    p50_ms: float | None
    p99_ms: float | None


class SlowFrame(MessagePart, frozen=True):
    """A slow frame: what it took its time for, in words."""

    sequence: int
    host_time_s: float
    text: str


class CalibrationNow(MessagePart, frozen=True):
    """How touches fit the calibration that locates them; ``broken``: someone must act."""

    well: bool
    broken: bool
    findings: tuple[str, ...]


class RunState(Message, frozen=True, tag="state"):
    """One look at the runner.

    ``stages``: from the sample to the page; ``slowest``: the slowest frame first; ``rule``: what
    chose alpha ("hand": the skin file); ``left_out``: measurements that the image does without;
    ``recording``: the file's name; ``problem``: what someone must act on.
    """

    running: bool
    paused: bool
    fps: float
    frames: int
    dropped: int
    corrupt: int
    gaps: int
    late: int
    deaf: int
    p50_ms: float | None
    p99_ms: float | None
    stages: list[StageNow]
    slowest: list[SlowFrame]
    reference: ReferenceNow
    baseline: BaselineNow | None
    sick: tuple[ElectrodeHealth, ...]
    noise_v: float | None
    alpha: float
    rule: str
    left_out: int
    recording: str | None
    sinks: tuple[SinkReport, ...]
    replay: ReplayStatus | None
    calibration: CalibrationNow | None
    problem: str | None
    text: str


class EventNote(Message, frozen=True, tag="event"):
    """Something that a person should know."""

    time_s: float
    kind: str
    text: str


class Refusal(Message, frozen=True, tag="error"):
    """Answer to a request that was not understood, or cannot be done."""

    message: str


class UnresolvedMap(Message, frozen=True, tag="unresolved"):
    """Of each cell the part of a change that the data leave open, 0 to 1; or the problem."""

    values: Flat | None
    radius_m: float
    problem: str


class DentNow(Message, frozen=True, tag="dent"):
    """Why frames hold no dent of touches, in words; "" where they do."""

    problem: str


class PlayedTimeline(Message, frozen=True, tag="timeline"):
    """What happened in the recording that is played, at times from its first frame."""

    end_s: float
    notes: list[EventNote]
    events: list[EventNote]
    touches: tuple[Span, ...]


class EstimatedNow(MessagePart, frozen=True):
    """A number, and the interval that nine in ten lie in."""

    value: float | None
    low: float | None
    high: float | None


class DeformationNow(MessagePart, frozen=True):
    """How the sheet is deformed as a whole in a frame, as every message says it (docs/sinks.md).

    It goes with the frame, behind its readings.
    """

    kind: Literal["fold", "stretch", "common", "unknown"]
    unit: Literal["rad", "strain", "relative"]
    axis: EstimatedNow | None
    offset: EstimatedNow | None
    width: EstimatedNow | None
    amount: EstimatedNow | None
    across: EstimatedNow | None
    confused: str | None
    text: str


# Files, sources, calibrations.


class FileEntry(MessagePart, frozen=True):
    """A file: size in bytes, when it was last written (s since 1970), notes on it."""

    name: str
    kind: str
    size: int
    written: float
    notes: str = ""


class Files(Message, frozen=True, tag="files"):
    """The session folder; ``others`` are not listed; ``share`` of the export is done, 0 to 1."""

    files: tuple[FileEntry, ...]
    others: int
    recording: str | None
    playing: str | None
    exporting: str | None
    share: float


class Exported(Message, frozen=True, tag="exported"):
    """An export has ended, and its file is there."""

    name: str


class Offer(MessagePart, frozen=True):
    """A source that a page may choose: what opens it, and in words what it is."""

    id: str
    text: str


class BoardNow(MessagePart, frozen=True):
    """What the board says that it is; ``name`` is empty before protocol 1.2."""

    name: str
    firmware: str
    protocol: str
    channels: int
    adc_bits: int
    current_ma: float
    unique_id: str


class Sources(Message, frozen=True, tag="sources"):
    """What can be connected, and what is."""

    sources: list[Offer]
    current: str
    host_protocol: str
    board: BoardNow | None
    problem: str | None


class Calibrations(Message, frozen=True, tag="calibrations"):
    """Files of the calibrations in use; "" where the name is not known; null: none.

    ``most``: the largest amounts that were learnt from: "force", N, and "depth", m.
    """

    touch: str | None
    force: str | None
    depth: str | None
    most: dict[str, float]


# Guided flows.

Phase = Literal["rest", "press", "hold", "release", "several", "name", "rub"]


class LabelNow(MessagePart, frozen=True):
    """A weight or depth, in the unit in which it was given, in SI, and in words."""

    value: float
    unit: Unit
    si: float
    text: str


class RubbedNow(MessagePart, frozen=True):
    """What was rubbed so far.

    ``places`` are the positions of the map, ``covered`` how many touches lay near each; ``text``
    says what is missing.
    """

    touches: int
    needed: int
    text: str
    enough: bool
    places: Flat
    covered: Flat


class Figures(MessagePart, frozen=True, omit_defaults=True):
    """Numbers of an estimate, as far as its flow has them."""

    errors_mm: Flat | None = None
    median_mm: float | None = None
    doubtful: list[int] | None = None
    probability: float | None = None
    mapping: str | None = None
    runner_up: str | None = None
    errors: Flat | None = None
    deviation_mm: float | None = None
    remarks: list[str] | None = None


class FlowNow(Message, frozen=True, tag="flow"):
    """The guided flow; ``kind`` null: none goes on. ``offered``: those that may be begun.

    ``paused``: no page shows it, and nothing is recorded; ``effort``: how to press the dot;
    ``labels``: what each press was; ``label``: what it is now or next; ``asked``: what was said and
    is probably meant as ``meant``; ``stage``: how far learning is.
    """

    offered: tuple[str, ...] = ()
    kind: str | None = None
    paused: bool = False
    phase: Phase = "rest"
    dot: Point | None = None
    presses: list[Point] = []
    thinking: bool = False
    text: str = ""
    ready: bool = False
    figures: Figures = Figures()
    effort: Literal["softly", "hard"] | None = None
    labels: list[str] = []
    label: LabelNow | None = None
    asked: LabelNow | None = None
    meant: LabelNow | None = None
    rubbed: RubbedNow | None = None
    stage: str = ""


PAGE_MESSAGES = (
    *(Scene, Scale, RunState, EventNote, Refusal, UnresolvedMap, DentNow, PlayedTimeline),
    *(Files, Exported, Sources, Calibrations, FlowNow),
)
"""What the page of one skin is sent, beside :data:`~.settings_messages.SETTINGS_MESSAGES`."""
