"""How the run is doing: how fast frames came, where the age of a picture comes from, what a frame
took its time for; and all of it for a person and for a program."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import pairwise
from operator import attrgetter
from pathlib import Path

import numpy as np

from tomoskin.board.wire import Info
from tomoskin.core import Frame, watch_stages
from tomoskin.imaging import AlphaChoice
from tomoskin.learning import CalibrationHealth, Reading
from tomoskin.pipeline import ReferenceState
from tomoskin.run.sinks import SinkReport
from tomoskin.sensing.signal import ElectrodeHealth

_KEPT = 50
"""Frames of which the cost is kept: the slowest."""

_SLOW_AMONG = 20_000
"""Newest frames that these are of."""

_OFTEN = 100
"""Frames after which what is older than the window is forgotten."""

_BEGIN = "voltages"
_SHOWN = 4
"""Stages that a text names, those that took longest first."""


@dataclass(frozen=True, slots=True)
class FrameCost:
    """What one frame's work was.

    Attributes
    ----------
    number, sequence, host_time
        Of the frame: counted by the host and by the board, and when it was read, s.
    seconds
        That all stages took together.
    stages
        Of each stage its name, µs, and how often it began, in the order of the first time.
    """

    number: int
    sequence: int
    host_time: float
    seconds: float
    stages: tuple[tuple[str, float, int], ...]

    @property
    def text(self) -> str:
        """What took longest, in words: "3.1 ms: touches 1.9 (2 times), one touch more 0.7"."""
        longest = sorted(self.stages, key=lambda stage: -stage[1])[:_SHOWN]
        parts = [
            f"{name} {spent / 1e3:.2f}" + (f" ({times} times)" if times > 1 else "")
            for name, spent, times in longest
        ]
        return f"{1e3 * self.seconds:.2f} ms: {', '.join(parts)}"


class CostMeter:
    """Times the stages that a frame's work says it has reached (:func:`tomoskin.core.reach`).

    Written by one thread, read by any.
    """

    def __init__(self, clock: Callable[[], float]) -> None:
        """Begin to measure with ``clock``, which gives seconds; ``slowest``: of the newest frames,
        the slowest first."""
        self._clock, self._count = clock, 0
        self.slowest: tuple[FrameCost, ...] = ()

    @contextmanager
    def of(self, frame: Frame) -> Iterator[None]:
        """Time what the block does with ``frame``."""
        marks = [(_BEGIN, self._clock())]
        try:
            with watch_stages(lambda stage: marks.append((stage, self._clock()))):
                yield
        finally:
            marks.append(("", self._clock()))
            self._keep(frame, marks)

    def _keep(self, frame: Frame, marks: list[tuple[str, float]]) -> None:
        number, self._count, slowest = self._count, self._count + 1, self.slowest
        seconds = marks[-1][1] - marks[0][1]
        if len(slowest) == _KEPT and number % _OFTEN and seconds <= slowest[-1].seconds:
            return
        cost = FrameCost(number, frame.sequence, frame.host_time, seconds, _stages(marks))
        newest = [one for one in (*slowest, cost) if one.number > number - _SLOW_AMONG]
        self.slowest = tuple(sorted(newest, key=attrgetter("seconds"), reverse=True)[:_KEPT])


def _stages(marks: list[tuple[str, float]]) -> tuple[tuple[str, float, int], ...]:
    """Of each stage its name, µs, and how often it began."""
    spent: dict[str, tuple[float, int]] = {}
    stage = ""
    for (reached, since), (_, until) in pairwise(marks):
        begins = reached not in ("", stage)
        stage = reached or stage
        us, times = spent.get(stage, (0.0, 0))
        spent[stage] = us + 1e6 * (until - since), times + begins
    return tuple((name, us, times) for name, (us, times) in spent.items())


_WINDOW = 512
"""Frames whose times are kept: some seconds of a real board."""

_RECENT = 1.0
"""Seconds over which the rate is counted."""

_TIMED = ("sample", "decode", "reconstruct", "publish")


@dataclass(frozen=True, slots=True)
class StageLatency:
    """How long one stage took of late, s: median and 99th percentile; NaN: not known."""

    name: str
    p50: float
    p99: float


class Latency:
    """Times of the last frames, in bounded memory; each is written by one thread, read by any.

    ``frames``: their number since the start.
    """

    def __init__(self, window: int = _WINDOW) -> None:
        """Make counters without any times."""
        self._times = {name: deque[float](maxlen=window) for name in _TIMED}
        self._arrivals, self._ages = deque[float](maxlen=window), deque[float](maxlen=window)
        self._painted: dict[object, tuple[float, float]] = {}
        self._last: Frame | None = None
        self.frames = 0

    def add_frame(self, frame: Frame, read: float, tick_rate: float) -> None:
        """Note a frame whose last byte was read at ``read``, s; ``tick_rate`` in Hz."""
        self.frames += 1
        self._arrivals.append(read)
        last, self._last = self._last, frame
        if last is not None and frame.sequence == last.sequence + 1 and frame.ticks > last.ticks:
            self._times["sample"].append((frame.ticks - last.ticks) / tick_rate)

    def add_result(self, decode: float, reconstruct: float) -> None:
        """Note how long a frame took from its last byte to the pipeline, and from there to its
        touches, s."""
        self._times["decode"].append(decode)
        self._times["reconstruct"].append(reconstruct)
        self._ages.append(decode + reconstruct)

    def add_published(self, seconds: float) -> None:
        """Note how long it took from a frame's touches to a page's connection."""
        self._times["publish"].append(seconds)

    def set_paint(self, page: object, p50: float, p99: float) -> None:
        """What a page says of its own drawing, s."""
        self._painted[page] = p50, p99

    def forget(self, page: object) -> None:
        """Forget a page that has stopped drawing."""
        self._painted.pop(page, None)

    def age(self) -> tuple[float, float]:
        """(p50, p99) from a frame's last byte to its touches, s; NaN before the first."""
        return _percentiles(self._ages)

    def rate(self, now: float) -> float:
        """Frames per second over the last second; 0 where fewer than two came."""
        recent = [time for time in self._arrivals.copy() if time > now - _RECENT]
        span = max(recent) - min(recent) if recent else 0.0
        return (len(recent) - 1) / span if span > 0 else 0.0

    def stages(self) -> tuple[StageLatency, ...]:
        """All stages, in the order of the flow; of the pages the one that is slowest."""
        slowest = max(
            self._painted.copy().values(), key=lambda p: p[1], default=(float("nan"),) * 2
        )
        timed = [StageLatency(name, *_percentiles(self._times[name])) for name in _TIMED]
        return *timed, StageLatency("paint", *slowest)


def _percentiles(times: deque[float]) -> tuple[float, float]:
    """(p50, p99); NaN before the first. ``times`` may grow meanwhile, in another thread."""
    values = list(times.copy())
    if not values:
        return float("nan"), float("nan")
    p50, p99 = np.percentile(values, (50, 99))
    return float(p50), float(p99)


@dataclass(frozen=True, slots=True)
class ReplayStatus:
    """Where a replay is: s from its first frame; ``speed`` None for as fast as it goes."""

    now_s: float
    end_s: float
    speed: float | None
    loop: bool
    ended: bool


@dataclass(frozen=True, slots=True)
class Status:
    """One look at the runner.

    Attributes
    ----------
    source
        Name of the source.
    running
        Whether frames come in.
    paused
        Whether the picture is held.
    frames
        Frames that were read since the start.
    fps
        Frames per second over the last second.
    dropped
        Frames that the device or this host left out.
    corrupt
        Messages that were damaged on the way.
    gaps
        Frames that are missing in the sequence.
    late, deaf
        Frames whose samples the board read late; frames in which it lost bytes of this host.
    p50, p99
        Latency from a frame's last byte to its touches over the last frames, s; NaN at first.
    stages
        How long each stage takes, from the sample to the page.
    slowest
        What the slowest frames took their time for, the slowest first.
    reference
        How far the reference is.
    reference_age
        Seconds since it stood, or None.
    recording
        The file that is being recorded to, or None.
    choice
        The alpha of the pictures, and what chose it.
    left_out
        Rows that the newest picture does without.
    sinks
        How each sink is doing.
    replay
        Where a replay is; None where the source is another.
    electrodes
        Those that are not good.
    readings
        What calibrations read that is shown, by the name of their kind.
    calibration
        How touches fit the calibration that locates them; None where none does.
    problem
        What someone should see to, in one sentence, or None.
    board
        What the board says that it is, once it has.
    board_name
        What it calls itself; empty before protocol 1.2.
    """

    source: str
    running: bool
    paused: bool
    frames: int
    fps: float
    dropped: int
    corrupt: int
    gaps: int
    late: int
    deaf: int
    p50: float
    p99: float
    reference: ReferenceState
    reference_age: float | None
    choice: AlphaChoice
    left_out: int
    problem: str | None
    stages: tuple[StageLatency, ...] = ()
    slowest: tuple[FrameCost, ...] = ()
    recording: Path | None = None
    sinks: tuple[SinkReport, ...] = ()
    electrodes: tuple[ElectrodeHealth, ...] = ()
    replay: ReplayStatus | None = None
    readings: Mapping[str, Reading] = field(default_factory=dict)
    calibration: CalibrationHealth | None = None
    board: Info | None = None
    board_name: str = ""

    @property
    def text(self) -> str:
        """The status in one line of words."""
        if self.problem:
            return f"{self.source}: {self.problem}"
        if self.paused:
            return f"{self.source}: paused"
        if not self.reference.ready:
            taken, needed = self.reference.frames, self.reference.needed
            return f"{self.source}: taking the reference, {taken} of {needed} frames; do not touch"
        drift = self.reference.baseline.drift if self.reference.baseline else 0.0
        text = (
            f"{self.source}: {self.fps:.0f} frames/s, {self.dropped} dropped, "
            f"p99 {1e3 * self.p99:.1f} ms, drift {100 * drift:.1f} %"
        )
        if self.late:
            text += f", {self.late} with late samples"
        if self.deaf:
            text += f", {self.deaf} in which the board lost bytes"
        return ", ".join([text, *(reading.text for reading in self.readings.values())])
