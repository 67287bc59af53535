"""Where the frames of an experiment come from: a twin, a board on the table, or a recording.

Every experiment here is a row of stages: "nothing touches the skin", then a probe here, then
there. The twin presses by itself; before a board, the person at the terminal does, and says when;
a recording made with ``--record`` is played again, stage by stage.
"""

from __future__ import annotations

import argparse
import contextlib
import itertools
import json
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from figure_file import FigureFile, chosen, parser_of
from tomoskin.board.source import Link, ScanSettings, Transport, open_source
from tomoskin.core import DataError, FloatArray, Frame, VirtualClock
from tomoskin.files.session import SessionReader, SessionWriter
from tomoskin.model.pattern import Pattern, Scan
from tomoskin.model.skin import Skin
from tomoskin.sensing.signal import Readout
from tomoskin.twin import Pose, Probe, TwinSettings, TwinTransport, make_twin

FRAMES = 10
"""Frames of a stage, as many as the thesis averaged."""

REST = 1.0
"""Seconds from a change of the load to the first frame of its stage."""

PUBLISHED = {"gauge": 2.4, "gauge_across": 1.2}
"""The largest gauge factor that we found published for a knit; the twin's is 10."""

Changes = dict[str, dict[str, Any]]
"""Keys of the skin file that an experiment sets, section by section."""


def source_drive(n: int, *, driven: bool = False) -> Changes:
    """The thesis's adjacent drive: current enters at Ek and leaves at the next, the ground.

    Neighbouring pairs are read; with ``driven``, those that touch a driven electrode too.
    """
    pairs = np.column_stack([np.arange(n), (np.arange(n) + 1) % n])
    table = Pattern.from_pairs(n, pairs, pairs, include_driven=driven)
    rows = {"drive": table.drive.tolist(), "measure": table.measure.tolist()}
    return {"drive": {"pattern": None, **rows}}


class Bench(Protocol):
    """Frames of one stage of an experiment."""

    def frames(self, stage: str, probes: Sequence[Probe], n: int) -> list[Frame]:
        """``n`` frames while ``probes`` press; ``stage`` says it in words."""


@dataclass
class LiveBench:
    """A twin or a board behind a link; ``load`` brings a stage about and says when it stands."""

    link: Link
    load: Callable[[str, Sequence[Probe]], threading.Event]
    bend: Callable[[Pose], None] = lambda _: None

    def frames(self, stage: str, probes: Sequence[Probe], n: int) -> list[Frame]:
        """The first frames once the load has stood for a while."""
        stands = self.load(stage, probes)
        while not stands.is_set():
            self.link.poll(0.2)  # a board that hears nothing switches itself off
        frames: list[Frame] = []
        begin = None
        while len(frames) < n:
            for item in self.link.poll(0.2):
                if isinstance(item, Frame):
                    begin = item.host_time if begin is None else begin
                    frames += [item] if item.host_time >= begin + REST else []
        return frames[:n]


@dataclass
class RecordedBench:
    """A session file whose notes say where each stage begins."""

    session: SessionReader

    def frames(self, stage: str, probes: Sequence[Probe], n: int) -> list[Frame]:
        """The frames after the note ``stage``."""
        del probes
        at = next((note.host_time for note in self.session.notes() if note.text == stage), None)
        later = () if at is None else self.session.frames(since=at)
        found = [item.frame for item in itertools.islice(later, n)]
        if len(found) < n:
            raise DataError(f'holds no {n} frames of "{stage}"', where=str(self.session.path))
        return found


@dataclass
class Lab:
    """A skin, where its frames come from, and where its figure goes."""

    skin: Skin
    bench: Bench
    figure: FigureFile
    writer: SessionWriter | None = None
    seed: int | None = None
    """Of the twin; None before a board and with a recording."""

    def __post_init__(self) -> None:
        """Prepare what turns counts into volts."""
        self._readout = Readout.of(Scan.of(self.skin.pattern()), self.skin.readout)

    def bend(self, pose: Pose) -> None:
        """Bend the twin from here on; before a board the stage says it, a recording holds it."""
        if isinstance(self.bench, LiveBench):
            self.bench.bend(pose)

    @contextlib.contextmanager
    def otherwise(self, gain: float | None = None, **settings: Mapping[str, Any]) -> Iterator[Lab]:
        """A fresh twin of the same seed with other ``settings``: ``contact={"lock": inf}``.

        It says what an experiment would see without what is assumed; only a twin can.
        """
        assert self.seed is not None
        skin = self.skin.altered({"readout": {"gain": gain}} if gain else {})
        with _twin(skin, self.seed, settings) as bench:
            yield Lab(skin, bench, self.figure)

    def measure(self, stage: str, *probes: Probe, n: int = FRAMES) -> FloatArray:
        """(n, n_meas) V while ``probes`` press, in the order of the skin's pattern.

        Raises
        ------
        DataError
            When a sample stood at the converter's upper rail, where it says nothing.
        """
        frames = self.bench.frames(stage, probes, n)
        if self.writer is not None:
            self.writer.note(frames[0].host_time, stage)
            for frame in frames:
                self.writer.frame(frame)
        self._check_range(stage, frames)
        return np.stack([self._readout(frame).values for frame in frames])

    def _check_range(self, stage: str, frames: Sequence[Frame]) -> None:
        """A potential is never below the grounded electrode's, but may be above the converter's."""
        most = np.max([frame.samples for frame in frames], axis=0)
        if most.max() >= self._readout.high:
            sample, scan = int(most.argmax()), self._readout.scan
            source, sink = scan.drives[scan.sample_drive[sample]] + 1
            raise DataError(
                f"E{scan.sample_electrode[sample] + 1} stands at the converter's upper rail while "
                f"E{source} and E{sink} drive",
                where=stage,
                hint="lower the amplifier's gain, and [readout] gain with it",
            )

    def by_ground(self, values: FloatArray) -> FloatArray:
        """(n, n) of ``values`` (n_meas,): row by the grounded electrode, column by the pair."""
        pattern = self.skin.pattern()
        table = np.full((self.skin.n_electrodes,) * 2, np.nan)
        table[pattern.drive[:, 1], pattern.measure[:, 0]] = values
        return table


def in_front_of(skin: Skin, electrode: int, distance: float) -> tuple[float, float]:
    """The place ``distance`` m from an electrode towards the middle of the skin."""
    rim, middle = skin.electrode_centres[electrode], skin.outline.centre
    x, y = rim + (middle - rim) * distance / np.linalg.norm(middle - rim)
    return float(x), float(y)


@contextlib.contextmanager
def open_lab(
    name: str,
    arguments: Sequence[str] | None,
    title: str | None,
    changes: Changes | None = None,
) -> Iterator[Lab]:
    """The lab that the command line asks for, with the ``changes`` that the experiment needs.

    ``name`` is that of the experiment's figure.
    """
    options = options_of(name, arguments, title)
    skin = Skin.load(options.skin).altered(changes or {})
    if options.gain:
        skin = skin.altered({"readout": {"gain": options.gain}})
    with contextlib.ExitStack() as stack:
        bench = stack.enter_context(_bench(options, skin))
        writer = (
            stack.enter_context(SessionWriter(options.record, skin)) if options.record else None
        )
        print(f"amplifier gain {skin.readout.gain:g} ([readout] gain)", file=sys.stderr)
        seed = options.seed if options.source == "twin" else None
        yield Lab(skin, bench, options.figure, writer, seed)


def report(found: Mapping[str, float]) -> None:
    """Print the numbers of an experiment, as JSON where the command line asks for it."""
    if "--json" in sys.argv:
        print(json.dumps({name: float(value) for name, value in found.items()}))
        return
    for name, value in found.items():
        print(f"{name:<40} {value:10.4g}")


@contextlib.contextmanager
def _bench(options: argparse.Namespace, skin: Skin) -> Iterator[Bench]:
    kind, _, path = options.source.partition(":")
    if kind == "replay":
        with SessionReader(Path(path)) as session:
            if session.skin.pattern().identity != skin.pattern().identity:
                raise DataError("was recorded with another scan than this experiment's", where=path)
            yield RecordedBench(session)
    elif kind == "twin":
        with _twin(skin, options.seed, {}) as bench:
            yield bench
    else:
        with _link(open_source(options.source, skin), skin, time.monotonic) as link:
            yield LiveBench(link, lambda stage, _: _asked(stage))


@contextlib.contextmanager
def _twin(skin: Skin, seed: int, settings: Mapping[str, Mapping[str, Any]]) -> Iterator[Bench]:
    """The twin of ``skin``; ``settings`` differ from those of its preset, part by part."""
    preset, clock = TwinSettings.preset(skin.twin.preset, seed), VirtualClock()
    changed = {part: replace(getattr(preset, part), **some) for part, some in settings.items()}
    twin = make_twin(skin, replace(preset, **changed), clock)
    with _link(twin, skin, clock.now) as link:
        yield LiveBench(link, lambda _, probes: _pressed(twin, probes), twin.set_pose)


def _link(transport: Transport, skin: Skin, now: Callable[[], float]) -> Link:
    link = Link(transport, Scan.of(skin.pattern()), ScanSettings.of(skin), clock=now)
    link.connect()
    return link


def _pressed(twin: TwinTransport, probes: Sequence[Probe]) -> threading.Event:
    twin.set_presses(tuple(probes))
    done = threading.Event()
    done.set()
    return done


def _asked(stage: str) -> threading.Event:
    """Ask the person at the terminal, who may take their time."""
    done = threading.Event()

    def wait() -> None:
        input(f"Now: {stage}. Then press Enter. ")
        done.set()

    threading.Thread(target=wait, daemon=True).start()
    return done


def options_of(name: str, arguments: Sequence[str] | None, title: str | None) -> argparse.Namespace:
    """The command line that all experiments share; ``name`` is that of the figure."""
    parser = parser_of(title)
    parser.add_argument("--source", default="twin", help="twin, serial:PORT or replay:FILE")
    parser.add_argument("--skin", default="textile-disc-8", help="built-in name or path")
    parser.add_argument("--gain", type=float, help="of the amplifier, instead of the skin file's")
    parser.add_argument("--record", type=Path, help="also keep the frames in this session file")
    parser.add_argument("--seed", type=int, default=1, help="of the twin")
    return chosen(parser, arguments, name)
