"""Between the run's thread and the pages: each message made once, each page woken once."""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections import deque
from collections.abc import AsyncIterator, Callable, Sequence
from functools import partial
from pathlib import Path
from typing import get_args

import numpy as np

from tomoskin.board.source import Transport
from tomoskin.core import DataError, GeometryError, TomoskinError, WireError
from tomoskin.files.messages import own_touches
from tomoskin.files.session import read_timeline
from tomoskin.learning import DEPTH, DentMap, dent_map
from tomoskin.model.skin import Skin
from tomoskin.pipeline import FrameResult, Prepared, Unresolved, colour_limit
from tomoskin.run import FILE_NAME, Runner, SetPresses, Snapshot, StrictRequest, commands
from tomoskin.server import page_messages as to_page, views
from tomoskin.server.folder import Folder
from tomoskin.server.frames import encode_result
from tomoskin.server.page_connection import Handler, Handlers, Host, Page, Tasks, during
from tomoskin.server.requests import AskUnresolved, Painted, SetRecording, ShowDent
from tomoskin.twin import Probe


def run_handlers(runner: Runner, folder: Path, tasks: Tasks) -> Handlers:
    """Handlers of a run whose recordings go to ``folder``, under names of their own."""

    def submit(_: Page, request: commands.Command) -> None:
        runner.submit(request)

    def press(page: Page, request: SetPresses) -> None:
        runner.submit(commands.HoldPresses(page, _on_skin(request, runner.prepared.skin)))

    def paint(page: Page, request: Painted) -> None:
        runner.flow.latency.set_paint(page, request.p50_s, request.p99_s)

    def record(_: Page, request: SetRecording) -> None:
        tasks.keep(_record(runner, folder, on=request.on))

    def map_out(page: Page, _: AskUnresolved) -> None:
        tasks.run(page, partial(_unresolved, runner), lambda map_: page.post(map_.json))

    def play(page: Page, request: commands.ReplayCommand) -> None:
        tasks.run(page, partial(runner.ask, request), lambda _: None)  # a seek may read a file

    return {
        commands.TakeReference: submit,
        commands.SetPause: submit,
        commands.Note: submit,
        SetPresses: press,
        Painted: paint,
        AskUnresolved: map_out,
        SetRecording: record,
        **dict.fromkeys(get_args(commands.ReplayCommand), play),
    }


def _unresolved(runner: Runner) -> to_page.UnresolvedMap:
    """What the data of this moment cannot tell."""
    newest, prepared = runner.newest, runner.prepared
    health = newest.result.health if newest else None
    lost = np.zeros(prepared.pattern.n_meas, bool) if health is None else health.lost
    try:
        part = Unresolved.of(prepared, runner.flow.pipeline.choice.alpha, np.flatnonzero(lost))
    except TomoskinError as error:
        return to_page.UnresolvedMap(values=None, radius_m=0.0, problem=error.message)
    return to_page.UnresolvedMap(
        values=part.values.round(3).tolist(), radius_m=part.radius, problem=""
    )


async def _record(runner: Runner, folder: Path, *, on: bool) -> None:
    begin = commands.Record(folder / time.strftime(FILE_NAME))
    try:
        await asyncio.wrap_future(runner.submit(begin if on else commands.StopRecording()))
    except DataError as error:
        runner.say("recording-stopped", f"the recording did not start: {error}")


def _on_skin(request: SetPresses, skin: Skin) -> tuple[Probe, ...]:
    """A finger that has slid off the sheet presses nothing; WireError for no face at all."""
    asked = request.presses
    if not asked:
        return ()
    inside = skin.outline.contains(np.array([(p.x, p.y) for p in asked]))
    try:
        return tuple(p.contact for p, on in zip(asked, inside, strict=True) if on)
    except GeometryError as error:
        raise WireError(str(error)) from None


_STATE_PERIOD = 0.25
_FIRST_EVENTS = 20
"""Events of the past that a new page is sent."""


class Hub(Host):
    """The pages of one runner; lives in the event loop.

    Parameters
    ----------
    runner
        Where results come from.
    folder
        Where a page's recordings go, under names of their own.

    Attributes
    ----------
    opener
        Opens the source of the moment for a skin; None: it cannot follow another skin.
    tasks
        What pages have asked for and is under way.
    """

    def __init__(self, runner: Runner, folder: Path | None = None) -> None:
        super().__init__()
        self.runner = runner
        self.folder = Folder(folder or Path())
        self.opener: Callable[[Skin], Transport] | None = None
        self.tasks = Tasks()
        self._handlers: dict[type, Handler] = {}
        self._greetings: list[Callable[[], Sequence[to_page.Message]]] = []
        self._farewells: list[Callable[[Page], None]] = []
        self._next_event = 0
        self._timeline: to_page.PlayedTimeline | None = None
        self._past: deque[to_page.EventNote] = deque(maxlen=_FIRST_EVENTS)
        self._limit = colour_limit(runner.prepared)
        self._scene: to_page.Scene | None = None
        self._made: tuple[Snapshot, bool, bytes] | None = None
        self._dents = Dents(runner)
        self.serve(run_handlers(runner, self.folder.path, self.tasks))
        self.serve(self._dents.handlers, farewell=self._dents.pages.discard)

    def serve(
        self,
        handlers: Handlers,
        greeting: Callable[[], Sequence[to_page.Message]] = tuple,
        farewell: Callable[[Page], None] = lambda _: None,
    ) -> None:
        """Answer these requests too, before the first page comes.

        ``greeting``: messages for a new page, and for all where the runner has another skin or
        source; ``farewell``: called with a page that has gone.
        """
        self._handlers.update(handlers)
        self._greetings.append(greeting)
        self._farewells.append(farewell)

    @contextlib.asynccontextmanager
    async def running(self) -> AsyncIterator[None]:
        """Listen to the runner while the block lasts."""
        loop = asyncio.get_running_loop()

        def announce() -> None:
            if self.awaited:
                self.awaited = False
                loop.call_soon_threadsafe(self.wake)

        async with during(self._tick()):
            self._read_timeline()
            with self.runner.audience.watch(announce):
                yield

    def first(self) -> list[to_page.Message]:
        """Scene and state, what happened, and what the handlers greet with."""
        timeline = [self._timeline] if self._timeline else []
        return [*self._now(), *timeline, *self._greeting(), *self._past]

    def newest(self) -> bytes | None:
        """The newest result as a message, made once for all pages; None before the first."""
        shown = self.runner.newest
        if shown is None:
            return None
        asked = bool(self._dents.pages)
        if self._made is None or self._made[0] is not shown or self._made[1] is not asked:
            dent = self._dents.of(shown.result) if asked else None
            own = own_touches(self.runner.flow.out.stream, shown.result)
            made = encode_result(shown.result, shown.truth, shown.latency, dent, own)
            self._made = shown, asked, made
        return self._made[2]

    def note_sent(self, frame: bytes) -> None:
        """Note how long it took until a page's connection had ``frame``."""
        if self._made is not None and self._made[2] is frame:
            self.runner.flow.latency.add_published(time.monotonic() - self._made[0].ready)

    def leave(self, page: Page, why: str = "") -> None:
        """Serve ``page`` no longer, and lift what it pressed."""
        super().leave(page)
        self.runner.submit(commands.HoldPresses(page, ()))
        self.runner.flow.latency.forget(page)
        for farewell in self._farewells:
            farewell(page)
        if why:
            self.runner.say("page-dropped", why)

    def obey(self, page: Page, request: StrictRequest) -> None:
        """Do what a page asks. Raises WireError where that cannot be."""
        handler = self._handlers.get(type(request))
        if handler is None:
            raise WireError(f"{type(request).__name__} is not possible on this page")
        handler(page, request)

    def show(self) -> None:
        """Tell every page that the runner has another skin or source."""
        self._limit, self._scene = colour_limit(self.runner.prepared), None
        self._timeline = None
        self.tell(*self._now(), *self._greeting())
        self._read_timeline()

    def rescale(self, prepared: Prepared, limit: float) -> None:
        """Tell every page that pictures have another scale and unit from now on."""
        self._limit, self._scene = limit, None
        self.tell(to_page.Scale(limit=limit, unit=prepared.operator.unit))

    def _greeting(self) -> list[to_page.Message]:
        return [message for greeting in self._greetings for message in greeting()]

    def _now(self) -> tuple[to_page.Message, to_page.Message]:
        """The scene, made when it is first asked for, and the state."""
        runner, status, replay = self.runner, self.runner.status(), self.runner.flow.marker.replay
        if self._scene is None:
            self._scene = views.scene(
                runner.prepared,
                status.source,
                limit=self._limit,
                pressable=runner.flow.twin.pressable,
                truth=replay is not None and bool(replay.truth),
            )
        return self._scene, views.state(status)

    def _read_timeline(self) -> None:
        """Of a replay: tell every page what happened in the recording, once that has been read."""
        if (replay := self.runner.flow.marker.replay) is not None:
            self.tasks.keep(self._tell_timeline(replay.path))

    async def _tell_timeline(self, path: Path) -> None:
        try:
            timeline = await asyncio.to_thread(read_timeline, path)
        except DataError as error:
            self.runner.say("no-timeline", f"the events of the recording cannot be shown: {error}")
            return
        self._timeline = views.timeline(timeline)
        self.tell(self._timeline)

    async def _tick(self) -> None:
        while True:
            self._next_event, happened = self.runner.events.since(self._next_event)
            news = [views.event(event) for event in happened]
            self._past.extend(news)
            if self.pages:
                self.tell(*news, views.state(self.runner.status()))
            await asyncio.sleep(_STATE_PERIOD)


class Dents:
    """The ``pages`` that show the dent of touches, and what they are sent."""

    def __init__(self, runner: Runner) -> None:
        self._runner = runner
        self.pages: set[Page] = set()
        self.handlers: Handlers = {ShowDent: self._show}

    def _show(self, page: Page, request: ShowDent) -> None:
        """Send dents from now on, or no more; answer why there are none."""
        prepared, problem = self._runner.prepared, ""
        if DEPTH.name not in prepared.calibrations:
            problem = "depths are uncalibrated: teach them in Set up, or choose a calibration there"
        elif prepared.skin.layer is None:
            problem = 'the skin file does not give the layer: add layer = "3 mm" to [surface]'
        page.post(to_page.DentNow(problem=problem).json)
        (self.pages.add if request.on else self.pages.discard)(page)

    def of(self, result: FrameResult) -> DentMap | None:
        """The dent of its touches; None where nothing touches, or depths are not known."""
        layer, nodes = self._runner.prepared.skin.layer, self._runner.prepared.mesh.points
        if layer is None or not result.touches:
            return None
        return dent_map([touch.detection for touch in result.touches], nodes[:, :2], layer)
