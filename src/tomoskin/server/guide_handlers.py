"""Requests of the flows in which someone presses the skin."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from tomoskin.core import TomoskinError, WireError
from tomoskin.learning import Kind
from tomoskin.pipeline import FrameResult, Prepared
from tomoskin.run import Runner
from tomoskin.server.amount_flow import DepthFlow, ForceFlow
from tomoskin.server.folder import Folder
from tomoskin.server.guided_flow import GuidedFlow, StoppedError
from tomoskin.server.hub import Hub
from tomoskin.server.page_connection import Page
from tomoskin.server.page_messages import FlowNow
from tomoskin.server.press_flow import MappingFlow, TouchFlow
from tomoskin.server.requests import (
    AskPoint,
    BeginFlow,
    DeletePress,
    EndFlow,
    FlowKind,
    KeepFlow,
    LearnFlow,
    SetLabel,
    ShowFlow,
    StopLearning,
)
from tomoskin.server.rub_flow import RubFlow

_OF_FLOWS = (DeletePress, SetLabel, AskPoint, LearnFlow, StopLearning)
"""Requests that the flow of the moment answers."""

_FLOWS: dict[FlowKind, Callable[[Prepared], GuidedFlow]] = {
    flow.kind: flow for flow in (TouchFlow, MappingFlow, ForceFlow, DepthFlow, RubFlow)
}
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
        self._folder = Folder(hub.folder)
        self._flow: GuidedFlow | None = None
        self._shown_by: set[Page] = set()
        self._watching = contextlib.ExitStack()
        hub.serve(
            {
                BeginFlow: lambda page, request: self._begin(page, request.kind),
                ShowFlow: lambda page, request: self._show(page, on=request.on),
                EndFlow: lambda _, __: self._end(),
                KeepFlow: self._keep,
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
        return (self._flow.now() if self._flow else FlowNow(),)

    def _pause(self) -> bool:
        """Have the flow wait while no page shows it or a recording is played; True for a change."""
        flow, on = self._flow, bool(self._shown_by) and self._hub.runner.flow.marker.replay is None
        if flow is None or flow.paused != on:
            return False
        flow.show(on=on)
        return True

    def _begin(self, page: Page, kind: FlowKind) -> None:
        if self._hub.runner.flow.marker.replay is not None:
            raise WireError("presses need a live source: go back to live first")
        flow = _FLOWS[kind](self._hub.runner.prepared)
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

    def _keep(self, page: Page, request: KeepFlow) -> None:
        flow = self._flow
        if flow is None:
            raise WireError("there are no presses to save: press the skin first")
        estimate = flow.estimate
        if flow.estimating or estimate is None or not estimate.ready or estimate.answer is None:
            raise WireError("more presses are needed before this can be saved")
        runner = self._hub.runner
        work = partial(flow.keep, estimate.answer, self._folder, request.name, runner)
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
