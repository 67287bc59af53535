"""Requests of the flows in which someone presses the skin."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Sequence
from functools import partial
from typing import Any

from tomoskin.core import TomoskinError, WireError
from tomoskin.learning import FORCE, TOUCH, Kind
from tomoskin.pipeline import FrameResult, Prepared
from tomoskin.run import Runner
from tomoskin.server.calibration_handlers import CalibrationHandlers
from tomoskin.server.folder import Folder
from tomoskin.server.guided_flow import GuidedFlow, StoppedError
from tomoskin.server.hub import Hub
from tomoskin.server.page_messages import text_of
from tomoskin.server.press_flow import PressFlow
from tomoskin.server.requests import (
    AskPoint,
    BeginFlow,
    DeletePress,
    EndFlow,
    FlowKind,
    KeepFlow,
    LearnFlow,
    SetWeight,
    StopLearning,
    UndoPress,
)
from tomoskin.server.rub_flow import RubFlow
from tomoskin.server.task import Listener
from tomoskin.server.weigh_flow import WeighFlow

_OF_FLOWS = (UndoPress, DeletePress, SetWeight, AskPoint, LearnFlow, StopLearning)
"""Requests that the flow of the moment answers."""

_TEACHES: dict[FlowKind, Kind[Any]] = {"touch": TOUCH, "rub": TOUCH, "force": FORCE}
_LOOKS = 0.3
"""Seconds after which pages are told how far an estimate is."""


def begun(kind: FlowKind, prepared: Prepared) -> GuidedFlow:
    """A flow at its start. Raises WireError where the skin is not set up for it."""
    match kind:
        case "force":
            return WeighFlow(prepared)
        case "rub":
            return RubFlow(prepared)
        case _:
            return PressFlow(kind, prepared)


class GuideHandlers:
    """Hands frames and requests to the flow of the moment, and has it estimate.

    One flow for all pages: whoever stands at the skin presses.
    """

    def __init__(self, hub: Hub, calibrations: CalibrationHandlers) -> None:
        self._hub, self._calibrations = hub, calibrations
        self._folder = Folder(hub.folder)
        self._flow: GuidedFlow | None = None
        self._watching = contextlib.ExitStack()
        hub.serve(
            {
                BeginFlow: lambda _, request: self._begin(request.kind),
                EndFlow: lambda _, __: self._end(),
                KeepFlow: self._keep,
                **dict.fromkeys(_OF_FLOWS, lambda _, request: self._answer(request)),
            },
            self.greeting,
        )

    def greeting(self) -> Sequence[str]:
        """The state of the guided flow."""
        mesh = self._hub.runner.prepared.mesh
        if self._flow is not None and self._flow.prepared.mesh.identity != mesh.identity:
            self._leave()
        return (self._message(),)

    def _begin(self, kind: FlowKind) -> None:
        if self._hub.runner.replay is not None:
            raise WireError("presses need a live source: go back to live first")
        flow = begun(kind, self._hub.runner.prepared)
        self._leave()
        self._flow = flow
        look = partial(self._look, flow, asyncio.get_running_loop())
        self._watching.enter_context(self._hub.runner.audience.subscribe("guide", look))
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
        """A frame has come; in a thread of its own."""
        seen = flow.see(result)
        if seen is not None:
            with contextlib.suppress(RuntimeError):  # the loop has ended
                loop.call_soon_threadsafe(self._advance, flow, seen)

    def _advance(self, flow: GuidedFlow, seen: object) -> None:
        if flow is not self._flow:
            return
        if flow.take(seen):
            self._estimate(flow)
        self._tell()

    def _answer(self, request: object) -> None:
        flow = self._flow
        answer = flow.answers.get(type(request)) if flow else None
        if flow is None or answer is None:
            raise WireError("no press has been recorded that this could be about: begin first")
        if answer(request):
            self._estimate(flow)
        self._tell()

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

    def _keep(self, page: Listener, request: KeepFlow) -> None:
        flow = self._flow
        if flow is None:
            raise WireError("there are no presses to save: press the skin first")
        estimate = flow.estimate
        if flow.estimating or estimate is None or not estimate.ready or estimate.answer is None:
            raise WireError("more presses are needed before this can be saved")
        runner = self._hub.runner
        work = partial(flow.keep, estimate.answer, self._folder, request.name, runner)
        self._hub.tasks.run(page, work, partial(self._kept, flow.kind, runner))

    def _kept(self, kind: FlowKind, runner: Runner, name: str) -> None:
        self._leave()
        runner.say("kept", f"saved as {name} and in use from now on")
        if kind in _TEACHES:
            self._calibrations.note(_TEACHES[kind], name)
        else:
            self._hub.show()
        self._tell()

    def _tell(self) -> None:
        self._hub.tell([self._message()])

    def _message(self) -> str:
        return text_of(type="flow", **(self._flow.fields() if self._flow else {"kind": None}))
