"""Requests about the calibrations of the folder: which are in use."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from tomoskin.learning import FORCE, TOUCH, Kind, load_calibration
from tomoskin.run import commands
from tomoskin.server.folder import Folder
from tomoskin.server.hub import Hub
from tomoskin.server.page_messages import text_of
from tomoskin.server.requests import UseCalibration
from tomoskin.server.task import Listener

_OFFERED: dict[str, Kind[Any]] = {"touch": TOUCH, "force": FORCE}


class CalibrationHandlers:
    """Switches calibrations on and off, and knows which file each came from."""

    def __init__(self, hub: Hub) -> None:
        self._hub = hub
        self._folder = Folder(hub.folder)
        self._files: dict[str, str] = {}  # by kind; "": the name is not known
        self._used_on = ""
        hub.serve({UseCalibration: self._use}, self.greeting)

    def greeting(self) -> Sequence[str]:
        """The calibrations in use."""
        prepared = self._hub.runner.prepared
        if self._used_on != prepared.mesh.identity:
            self._used_on = prepared.mesh.identity
            self._files = dict.fromkeys(prepared.calibrations, "")
        return (self._message(),)

    def note(self, kind: Kind[Any], name: str | None) -> None:
        """The run goes on with the calibration in file ``name``, or None with none of ``kind``."""
        if name is None:
            self._files.pop(kind.name, None)
        else:
            self._files[kind.name] = name
        self._hub.tell([self._message()])

    def _use(self, page: Listener, request: UseCalibration) -> None:
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

    def _message(self) -> str:
        forces = self._hub.runner.prepared.calibrations.get(FORCE.name)
        return text_of(
            type="calibrations",
            **{of: self._files.get(kind.name) for of, kind in _OFFERED.items()},
            force_most_n=None if forces is None else forces.model.most,
        )
