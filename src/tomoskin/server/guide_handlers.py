"""Requests of the flows in which someone presses where the dot is."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Sequence
from functools import partial

from tomoskin.calibration import TOUCH
from tomoskin.core import FloatArray, TomoskinError, WireError
from tomoskin.pipeline import FrameResult
from tomoskin.run import commands
from tomoskin.server.folder import Folder
from tomoskin.server.hub import Hub
from tomoskin.server.page_messages import text_of
from tomoskin.server.press_flow import PressFlow, keep
from tomoskin.server.requests import (
    BeginFlow,
    EndFlow,
    FlowKind,
    KeepFlow,
    UndoPress,
    UseCalibration,
)
from tomoskin.server.task import Listener


class GuideHandlers:
    """Shows a dot, takes the press when it stands still, and says what the presses tell.

    One flow for all pages: whoever stands at the skin presses.
    """

    def __init__(self, hub: Hub) -> None:
        self._hub = hub
        self._folder = Folder(hub.folder)
        self._flow: PressFlow | None = None
        self._using: str | None = None  # the calibration's file; "": its name is not known
        self._used_on = ""
        self._watching = contextlib.ExitStack()
        hub.serve(
            {
                BeginFlow: lambda _, request: self._begin(request.kind),
                UndoPress: lambda _, __: self._undo(),
                EndFlow: lambda _, __: self._end(),
                KeepFlow: self._keep,
                UseCalibration: self._use,
            },
            self.greeting,
        )

    def greeting(self) -> Sequence[str]:
        """Where the flow is."""
        mesh = self._hub.runner.prepared.mesh
        if self._flow is not None and self._flow.prepared.mesh.identity != mesh.identity:
            self._leave()
        if self._used_on != mesh.identity:
            self._look_again()
        return (self._message(),)

    def _begin(self, kind: FlowKind) -> None:
        if self._hub.runner.replay is not None:
            raise WireError("a recording cannot be pressed: go back to live first")
        self._leave()
        flow = self._flow = PressFlow(kind, self._hub.runner.prepared)
        loop = asyncio.get_running_loop()
        look = partial(self._look, flow, loop)
        self._watching.enter_context(self._hub.runner.subscribe("guide", look))
        self._tell()

    def _leave(self) -> None:
        self._watching.close()
        self._flow = None

    def _end(self) -> None:
        self._leave()
        self._tell()

    def _look(self, flow: PressFlow, loop: asyncio.AbstractEventLoop, result: FrameResult) -> None:
        """A frame has come; in a thread of its own."""
        before = flow.taker.phase
        dv = flow.taker.push(result.host_time, result.voltages)
        if dv is not None or flow.taker.phase != before:
            with contextlib.suppress(RuntimeError):  # the loop has ended
                loop.call_soon_threadsafe(self._advance, flow, dv)

    def _advance(self, flow: PressFlow, dv: FloatArray | None) -> None:
        if flow is not self._flow:
            return
        if dv is not None:
            flow.add(dv)
            self._estimate(flow)
        self._tell()

    def _undo(self) -> None:
        flow = self._flow
        if flow is None:
            raise WireError("there is no press to take back")
        flow.undo()
        self._estimate(flow)
        self._tell()

    def _estimate(self, flow: PressFlow) -> None:
        if not flow.estimating:
            flow.estimating = True
            self._hub.tasks.keep(self._estimating(flow))

    async def _estimating(self, flow: PressFlow) -> None:
        """Estimate until there is no newer press."""
        while flow is self._flow:
            presses = tuple(flow.presses)
            try:
                flow.estimate = await asyncio.to_thread(flow.estimate_from, presses)
                flow.trouble = ""
            except TomoskinError as error:
                flow.estimate, flow.trouble = None, str(error)
            if tuple(flow.presses) == presses:
                break
        flow.estimating = False
        if flow is self._flow:
            self._tell()

    def _keep(self, page: Listener, request: KeepFlow) -> None:
        flow = self._flow
        if flow is None:
            raise WireError("nothing has been pressed")
        work = partial(keep, flow, flow.answer(), self._folder, request.name, self._hub.runner)

        def done(name: str) -> None:
            if flow.kind == "touch":
                self._using = name
            self._leave()
            self._hub.runner.say("kept", f"saved as {name} and in use from now on")
            if flow.kind == "wiring":
                self._hub.show()
            self._tell()

        self._hub.tasks.run(page, work, done)

    def _use(self, page: Listener, request: UseCalibration) -> None:
        def work() -> None:
            runner = self._hub.runner
            if request.name is None:
                prepared = runner.prepared.uncalibrated(TOUCH)
            else:
                calibration = TOUCH.read(self._folder.existing(request.name, ".npz"))
                prepared = runner.prepared.calibrated(calibration)
            runner.ask(commands.Adopt(prepared))

        def done(_: None) -> None:
            self._using = request.name
            self._tell()

        self._hub.tasks.run(page, work, done)

    def _look_again(self) -> None:
        """Another skin is there, with a calibration whose name is not known, or without."""
        prepared = self._hub.runner.prepared
        self._using = "" if TOUCH.name in prepared.calibrations else None
        self._used_on = prepared.mesh.identity

    def _tell(self) -> None:
        self._hub.tell([self._message()])

    def _message(self) -> str:
        flow = self._flow
        if flow is None:
            return text_of(type="flow", kind=None, calibration=self._using)
        return text_of(type="flow", **flow.fields(), calibration=self._using)
