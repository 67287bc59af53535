"""All that a page may ask, beside the commands to the run that the hub itself passes on: settings,
sources, calibrations, the twin, and the flows in which someone presses the skin."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import msgspec
import numpy as np

from tomoskin.core import TomoskinError, WireError, no_such, registered
from tomoskin.learning import DEPTH, FORCE, TOUCH, Kind, load_calibration
from tomoskin.pipeline import FrameResult
from tomoskin.run import Runner, SetPose, SetTwin, commands, way_to_bend
from tomoskin.server import requests
from tomoskin.server.amount_flow import DepthFlow, ForceFlow
from tomoskin.server.guided_flow import GuidedFlow, StoppedError
from tomoskin.server.hub import Hub
from tomoskin.server.page_connection import Page
from tomoskin.server.page_messages import Calibrations, FlowNow
from tomoskin.server.press_flow import MappingFlow, TouchFlow
from tomoskin.server.settings_handlers import SettingsHandlers
from tomoskin.server.settings_messages import TwinBend, TwinRefused, TwinState, TwinStretch
from tomoskin.server.source_handlers import SourceHandlers, SourceSwitch

_OFFERED: dict[str, Kind[Any]] = {"touch": TOUCH, "force": FORCE, "depth": DEPTH}


def serve_requests(hub: Hub, source: str) -> None:
    """Let ``hub`` answer every request, before the first page comes; ``source``: the first one."""
    SettingsHandlers(hub)
    TwinHandlers(hub)
    SourceHandlers(hub, SourceSwitch(hub, source))
    GuideHandlers(hub, CalibrationHandlers(hub).note)


class CalibrationHandlers:
    """Switches calibrations on and off, and knows which file each came from."""

    def __init__(self, hub: Hub) -> None:
        self._hub = hub
        self._files: dict[str, str] = {}  # by kind; "": the name is not known
        self._used_on = ""
        hub.serve({requests.UseCalibration: self._use}, self.greeting)

    def greeting(self) -> Sequence[Calibrations]:
        """The calibrations in use, as a new page learns of them."""
        prepared = self._hub.runner.prepared
        if self._used_on != prepared.mesh.identity:
            self._used_on = prepared.mesh.identity
            self._files = dict.fromkeys(prepared.calibrations, "")
        files = {of: self._files.get(kind.name) for of, kind in _OFFERED.items()}
        used = prepared.calibrations
        most = {name: used[name].model.most for name in (FORCE.name, DEPTH.name) if name in used}
        return (Calibrations(**files, most=most),)

    def note(self, kind: Kind[Any], name: str | None) -> None:
        """The run goes on with the calibration in file ``name``, or None with none of ``kind``."""
        if name is None:
            self._files.pop(kind.name, None)
        else:
            self._files[kind.name] = name
        self._hub.tell(*self.greeting())

    def _use(self, page: Page, request: requests.UseCalibration) -> None:
        def work() -> Kind[Any]:
            runner = self._hub.runner
            if request.name is None:
                kind = _OFFERED[request.of]
                runner.ask(commands.Adopt(runner.prepared.uncalibrated(kind)))
                return kind
            calibration = load_calibration(self._hub.folder.existing(request.name, ".npz"))
            runner.ask(commands.Adopt(runner.prepared.calibrated(calibration)))
            return calibration.kind

        self._hub.tasks.run(page, work, lambda kind: self.note(kind, request.name))


class TwinHandlers:
    """Bends, breaks and mends the twin, the same for all pages."""

    def __init__(self, hub: Hub) -> None:
        self._hub = hub
        self._newest: SetPose | None = None
        self._posing = asyncio.Lock()
        hub.serve({SetTwin: self._set, SetPose: self._pose}, self.greeting)

    def greeting(self) -> Sequence[TwinState]:
        """What is wrong now, and how the sheet is bent."""
        twin, skin = self._hub.runner.flow.twin, self._hub.runner.prepared.skin
        asked, bends = twin.pose.asked, way_to_bend(skin.surface)
        extent = np.ptp(skin.outline.polyline(skin.outline.length / 60), axis=0)
        now = TwinState.of(
            twin,
            cut=sorted(set(twin.harm.cut)),
            noise=twin.harm.noise,
            bends=bends,
            bend=asked.bend and TwinBend.of(asked.bend),
            stretch=asked.stretch and TwinStretch.of(asked.stretch),
            size_m=float(extent.max()),
        )
        return (now,)

    def _set(self, _: Page, request: SetTwin) -> None:
        """Raise WireError where the source is no twin, or has no such electrode."""
        self._hub.runner.ask(request)
        self._hub.tell(*self.greeting())

    def _pose(self, page: Page, request: SetPose) -> None:
        """Raise WireError where the source has no sheet to bend."""
        if not self._hub.runner.flow.twin.bendable:
            raise WireError(f"{self._hub.runner.flow.source} cannot be bent on the page")
        self._newest = request
        self._hub.tasks.keep(self._bring(page, request))

    async def _bring(self, page: Page, request: SetPose) -> None:
        """Bend the sheet unless something newer is asked for already, and say how it lies."""
        async with self._posing:
            if request is self._newest:
                try:
                    await asyncio.to_thread(self._hub.runner.ask, request)
                except TomoskinError as error:
                    page.post(TwinRefused(message=error.advice).json)
            self._hub.tell(*self.greeting())


_OF_FLOWS = (
    requests.DeletePress,
    requests.SetLabel,
    requests.AskPoint,
    requests.LearnFlow,
    requests.StopLearning,
)
"""Requests that the flow of the moment answers."""

_FLOWS: tuple[type[GuidedFlow], ...] = (TouchFlow, MappingFlow, ForceFlow, DepthFlow)

_LOOKS = 0.3
"""Seconds after which pages are told how far an estimate is."""


class GuideHandlers:
    """Hands frames and requests to the flow of the moment, and has it estimate.

    One flow for all pages: whoever stands at the skin presses. While no page shows it, it is
    paused.

    Parameters
    ----------
    hub
        Whose pages.
    note
        Called with the kind of a calibration that has been kept, and the name of its file.
    """

    def __init__(self, hub: Hub, note: Callable[[Kind[Any], str], None]) -> None:
        self._hub, self._note = hub, note
        self._flow: GuidedFlow | None = None
        more = (entry.load() for entry in registered("flows").values())
        self._flows: dict[str, type[GuidedFlow]] = {flow.kind: flow for flow in (*_FLOWS, *more)}
        self._shown_by: set[Page] = set()
        self._watching = contextlib.ExitStack()
        hub.serve(
            {
                requests.BeginFlow: lambda page, request: self._begin(page, request.kind),
                requests.ShowFlow: lambda page, request: self._show(page, on=request.on),
                requests.EndFlow: lambda _, __: self._end(),
                requests.KeepFlow: self._keep,
                **dict.fromkeys(_OF_FLOWS, lambda _, request: self._answer(request)),
            },
            self.greeting,
            lambda page: self._show(page, on=False),
        )

    def greeting(self) -> Sequence[FlowNow]:
        """The state of the guided flow."""
        mesh = self._hub.runner.prepared.mesh
        if self._flow is not None and self._flow.prepared.mesh.identity != mesh.identity:
            self._leave()
        self._pause()
        now = self._flow.now() if self._flow else FlowNow()
        return (msgspec.structs.replace(now, offered=tuple(self._flows)),)

    def _pause(self) -> bool:
        """Have the flow wait while no page shows it or a recording is played; True for a change."""
        flow, on = self._flow, bool(self._shown_by) and self._hub.runner.flow.marker.replay is None
        if flow is None or flow.paused != on:
            return False
        flow.show(on=on)
        return True

    def _begin(self, page: Page, kind: str) -> None:
        if self._hub.runner.flow.marker.replay is not None:
            raise WireError("presses need a live source: go back to live first")
        if kind not in self._flows:
            raise WireError(no_such(kind, self._flows, "a guided flow"))
        flow = self._flows[kind](self._hub.runner.prepared)
        if isinstance(flow, DepthFlow):
            flow.skin_says = lambda: self._hub.runner.flow.twin.depth
        self._leave()
        self._flow, self._shown_by = flow, {page}
        look = partial(self._look, flow, asyncio.get_running_loop())
        self._watching.enter_context(self._hub.runner.audience.subscribe("guide", look))
        self._tell()

    def _show(self, page: Page, *, on: bool) -> None:
        """A page shows the flow, or does not any more."""
        if on:
            self._shown_by.add(page)
        else:
            self._shown_by.discard(page)
        if self._pause():
            self._tell()

    def _leave(self) -> None:
        self._watching.close()
        if self._flow is not None:
            self._flow.stop()
        self._flow = None

    def _end(self) -> None:
        self._leave()
        self._tell()

    def _look(self, flow: GuidedFlow, loop: asyncio.AbstractEventLoop, result: FrameResult) -> None:
        """Hand over a frame; in a thread of its own."""
        with flow.lock:
            played = self._hub.runner.flow.marker.replay is not None  # its presses were on no dot
            news = None if flow.paused or played else flow.see(result)
        if news is not None:
            with contextlib.suppress(RuntimeError):  # the loop has ended
                loop.call_soon_threadsafe(self._advance, flow, news)

    def _advance(self, flow: GuidedFlow, more: bool) -> None:
        """Estimate where there is ``more`` to estimate from, and tell the pages."""
        if flow is not self._flow:
            return
        if more:
            self._estimate(flow)
        self._tell()

    def _answer(self, request: object) -> None:
        flow = self._flow
        answer = flow.answers.get(type(request)) if flow else None
        if flow is None or answer is None:
            raise WireError("no press has been recorded that this could be about: begin first")
        with flow.lock:
            more = answer(request)
        self._advance(flow, more)

    def _estimate(self, flow: GuidedFlow) -> None:
        if not flow.estimating:
            flow.estimating = True
            self._hub.tasks.keep(self._estimating(flow))

    async def _estimating(self, flow: GuidedFlow) -> None:
        """Estimate until there is nothing newer."""
        while flow is self._flow:
            examples = flow.examples()
            work = asyncio.create_task(asyncio.to_thread(flow.estimated, examples))
            while not (await asyncio.wait([work], timeout=_LOOKS))[0]:
                self._tell()
            try:
                flow.estimate, flow.trouble = work.result(), ""
            except StoppedError:
                flow.estimate, flow.trouble = None, ""
            except TomoskinError as error:
                flow.estimate, flow.trouble = None, str(error)
            if flow.examples() == examples:
                break
        flow.estimating, flow.stage = False, ""
        if flow is self._flow:
            self._tell()

    def _keep(self, page: Page, request: requests.KeepFlow) -> None:
        flow = self._flow
        if flow is None:
            raise WireError("there are no presses to save: press the skin first")
        estimate = flow.estimate
        if flow.estimating or estimate is None or not estimate.ready or estimate.answer is None:
            raise WireError("more presses are needed before this can be saved")
        runner = self._hub.runner
        work = partial(flow.keep, estimate.answer, self._hub.folder, request.name, runner)
        self._hub.tasks.run(page, work, partial(self._kept, flow.teaches, runner))

    def _kept(self, kind: Kind[Any] | None, runner: Runner, name: str) -> None:
        self._leave()
        runner.say("kept", f"saved as {name} and in use from now on")
        if kind is None:
            self._hub.show()
        else:
            self._note(kind, name)
        self._tell()

    def _tell(self) -> None:
        self._hub.tell(*self.greeting())
