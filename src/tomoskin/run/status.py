"""How the running pipeline is doing, for a person and for a program."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from tomoskin.board.wire import Info
from tomoskin.imaging import AlphaChoice
from tomoskin.learning import BendReading, CalibrationHealth, ClassReading
from tomoskin.pipeline import ReferenceState
from tomoskin.run.counters import FrameCost, StageLatency
from tomoskin.run.sinks import SinkReport
from tomoskin.sensing.signal import ElectrodeHealth


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
    bend
        How the sheet is bent; None where its bends were not learnt.
    state
        Which of the learnt classes it shows; None where none was learnt.
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
    bend: BendReading | None = None
    class_reading: ClassReading | None = None
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
        return (
            f"{self.source}: {self.fps:.0f} frames/s, {self.dropped} dropped, "
            f"p99 {1e3 * self.p99:.1f} ms, drift {100 * drift:.1f} %"
            f"{self._bend_text}{self._state_text}"
        )

    @property
    def _bend_text(self) -> str:
        if self.bend is None:
            return ""
        return f", bend {math.degrees(self.bend.angle):.0f}° ({self.bend.state})"

    @property
    def _state_text(self) -> str:
        return "" if self.class_reading is None else f", {self.class_reading.text}"
