"""All that a page may ask, beside the commands to the run that the hub itself passes on."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from typing import Any

import numpy as np

from tomoskin.core import TomoskinError, WireError
from tomoskin.learning import DEPTH, FORCE, TOUCH, Kind, load_calibration
from tomoskin.run import SetPose, SetTwin, commands, way_to_bend
from tomoskin.server.folder import Folder
from tomoskin.server.guide_handlers import GuideHandlers
from tomoskin.server.hub import Hub
from tomoskin.server.page_connection import Page
from tomoskin.server.page_messages import Calibrations
from tomoskin.server.requests import UseCalibration
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
        self._folder = Folder(hub.folder)
        self._files: dict[str, str] = {}  # by kind; "": the name is not known
        self._used_on = ""
        hub.serve({UseCalibration: self._use}, self.greeting)

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

    def _use(self, page: Page, request: UseCalibration) -> None:
        def work() -> Kind[Any]:
            runner = self._hub.runner
            if request.name is None:
                kind = _OFFERED[request.of]
                runner.ask(commands.Adopt(runner.prepared.uncalibrated(kind)))
                return kind
            calibration = load_calibration(self._folder.existing(request.name, ".npz"))
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
                    hint = f" ({error.hint})" if error.hint else ""
                    page.post(TwinRefused(message=error.message + hint).json)
            self._hub.tell(*self.greeting())
