"""A script run on a twin, faster than real time, into a session file with the truth inside."""

from __future__ import annotations

import contextlib
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from threadpoolctl import threadpool_limits

from tomoskin import twin
from tomoskin.board.source import Configuration, Link, ScanSettings
from tomoskin.core import DataError, Event, Frame, Mark, StrPath, VirtualClock
from tomoskin.files.session import Advance, SessionWriter, no_report
from tomoskin.model.pattern import Scan
from tomoskin.model.skin import Skin
from tomoskin.pipeline import REFERENCE_FRAMES
from tomoskin.run.twin_control import described

_EMPTY_READ = 0.5


@dataclass(frozen=True)
class Simulated:
    """What a script has left: frames in the file, frames lost on the line, seconds of the skin."""

    frames: int
    lost: int
    seconds: float


def simulate(
    script: twin.Script,
    skin: Skin,
    out: StrPath,
    *,
    seed: int | None = None,
    advance: Advance = no_report,
) -> Simulated:
    """Run ``script`` on the twin of ``skin`` into the new session file ``out``.

    The file says that its first reference is made of the frames before anything presses or
    breaks. The same script, skin and seed give the same bytes. Whatever ends it, the file is
    readable up to there, and a note at its end says that it is only a part, and why.

    Parameters
    ----------
    seed
        Instead of the script's own.
    advance
        Called with the seconds that have gone by on the skin, and all of them.

    Raises
    ------
    ScriptError
        When the script cannot be run on this skin; then no file is made.
    DataError
        When the file exists already or cannot be written.
    SourceError
        When the board cannot be brought to scan any more, for all the script's faults.
    """
    out = Path(out)
    twin.check_script(script, skin)
    chosen = script.seed if seed is None else seed
    settings = twin.TwinSettings.preset(script.preset or skin.twin.preset, chosen)
    with threadpool_limits(1), SessionWriter(out, skin) as writer:
        return _Run(script, skin, settings, writer).to_the_end(advance)


class _Wired:
    """A transport whose bytes go over the script's line."""

    def __init__(self, board: twin.TwinTransport, seed: int) -> None:
        self.name, self.line, self._board = board.name, twin.Line(twin.LineSettings(), seed), board
        self.write, self.close = board.write, board.close

    def read(self, timeout: float) -> bytes:
        """What arrives of the twin's next bytes."""
        return self.line.carry(self._board.read(timeout))


class _Run:
    """One run of a script: a clock, a twin, and the link to it."""

    def __init__(
        self, script: twin.Script, skin: Skin, settings: twin.TwinSettings, writer: SessionWriter
    ) -> None:
        self._script, self._settings, self._writer = script, settings, writer
        self._clock = VirtualClock()
        self._board = twin.make_twin(skin, settings, self._clock)
        self._wire = _Wired(self._board, settings.seed)
        self._scan, self._asked = Scan.of(skin.pattern()), ScanSettings.of(skin)
        self._frame_time = Configuration.of(self._scan, self._asked).scan_time
        contact = settings.contact
        self._friction = {"slide": contact.friction, "roll": contact.rolling_friction}
        self._truth: tuple[tuple[twin.Probe, ...], list[dict[str, float | str]]] = ((), [])
        self._disturbance = twin.Disturbance()
        self._marks = sorted(script.marks, key=lambda mark: mark.given.at)
        self._frames = 0

    def to_the_end(self, advance: Advance) -> Simulated:
        """Connect, idle for the lead-in, then follow the script."""
        script, clock = self._script, self._clock
        with Link(
            self._wire, self._scan, self._asked, clock=clock.now, tap=self._writer.raw
        ) as link:
            self._writer.device(clock.now(), link.connect())
            idle = _idle_frames(script, self._frame_time)
            self._writer.settings(clock.now(), _described(script, self._settings, idle))
            self._writer.truth(clock.now(), ())
            try:
                self._follow(link, advance)
            except BaseException as error:  # Ctrl-C too
                gone, complete = clock.now(), script.lead_in + script.duration
                with contextlib.suppress(DataError):  # of a disk that is full, say
                    why = "interrupted" if isinstance(error, KeyboardInterrupt) else str(error)
                    self._writer.note(gone, f"stopped after {gone:.1f} of {complete:g} s: {why}")
                raise
            return Simulated(self._frames, link.frames.lost, script.duration + script.lead_in)

    def _follow(self, link: Link, advance: Advance) -> None:
        script, clock = self._script, self._clock
        begin, last = clock.now() + script.lead_in, -script.lead_in
        while (time := clock.now() - begin) < script.duration:
            self._set(begin, last, time)
            self._take(link)
            advance(time + script.lead_in, script.duration + script.lead_in)
            last = time

    def _set(self, begin: float, last: float, time: float) -> None:
        """Bring about what the script says of ``time``, for the scan that begins now.

        Presses may move during the scan. The truth is that of its middle and is noted there: the
        frame before has the same time as its start.
        """
        half = self._frame_time / 2
        middle = begin + time + half
        bends = self._script.bends
        self._board.electronics.follow(
            lambda since: self._pressed(time + since),
            (lambda since: twin.bent(bends, time + since)) if bends else None,
        )
        truth = self._pressed(time + half), twin.bent_truth(bends, time + half)
        if truth != self._truth:
            self._truth = truth
            self._writer.truth(middle, list(map(described, truth[0])), truth[1])
        self._disturb(twin.disturbed(self._script.faults, time))
        if twin.reboots(self._script.faults, last, time):
            self._board.reboot()
        while self._marks and begin + self._marks[0].given.at < middle:
            self._writer.note(middle, self._marks.pop(0).given.text)

    def _pressed(self, time: float) -> tuple[twin.Probe, ...]:
        return twin.pressed(self._script.presses, time, self._friction)

    def _disturb(self, now: twin.Disturbance) -> None:
        before, self._disturbance = self._disturbance, now
        if now == before:
            return
        self._board.set_faults(now.faults)
        self._board.sheet.warm(now.warmer - before.warmer)
        self._wire.line.settings = now.line
        own = self._settings.electronics
        noise = own.noise if now.noise is None else now.noise
        self._board.electronics.settings = replace(own, noise=noise)

    def _take(self, link: Link) -> None:
        for item in link.poll(_EMPTY_READ):
            if isinstance(item, Frame):
                self._writer.frame(item, Mark.NONE if self._frames else Mark.REFERENCE)
                self._frames += 1
            elif isinstance(item, Event):
                self._writer.event(item)


def _idle_frames(script: twin.Script, frame_time: float) -> int:
    """Whole frames before anything presses or breaks, of at most what a live reference takes."""
    starts = [one.given.start for one in (*script.presses, *script.bends, *script.faults)]
    quiet = script.lead_in + min(starts, default=script.duration)
    return max(1, min(REFERENCE_FRAMES, int(quiet / frame_time)))


def _described(script: twin.Script, settings: twin.TwinSettings, idle: int) -> dict[str, object]:
    return {
        "command": "simulate",
        "script": script.name,
        "reference_frames": idle,
        "twin": asdict(settings),
    }
