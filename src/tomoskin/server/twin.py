"""The desk that bends, breaks and mends the twin."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import msgspec
import numpy as np

from tomoskin.core import GeometryError, ModelError, WireError
from tomoskin.run import Harm, SetPose, SetTwin, posed, way_to_bend
from tomoskin.server.hub import Hub, Listener
from tomoskin.twin import Faults


class TwinDesk:
    """What is done to the twin beside pressing it, the same for all pages."""

    def __init__(self, hub: Hub) -> None:
        self._hub = hub
        self._newest: SetPose | None = None
        self._posing = asyncio.Lock()

    @property
    def handlers(self) -> Mapping[type, Callable[[Listener, Any], None]]:
        """See :class:`~tomoskin.server.hub.Desk`."""
        return {SetTwin: self._set, SetPose: self._pose}

    def greeting(self) -> Sequence[str]:
        """What is wrong now, and how the sheet is bent."""
        runner = self._hub.runner
        harm, asked = runner.harmed, runner.posed.asked
        skin = runner.prepared.skin
        extent = np.ptp(skin.outline.polyline(skin.outline.length / 60), axis=0)
        fields = {
            "type": "twin",
            "breakable": runner.breakable,
            "cut": sorted(harm.faults.cut),
            "noise": harm.noise,
            "bendable": runner.bendable,
            "bends": way_to_bend(skin.surface),
            "bend": asked.bend,
            "stretch": asked.stretch,
            "size_m": float(extent.max()),
        }
        return (msgspec.json.encode(fields).decode(),)

    def _set(self, _: Listener, request: SetTwin) -> None:
        """Raise WireError where the source is no twin, or has no such electrode."""
        runner = self._hub.runner
        if not runner.breakable:
            raise WireError(f"{runner.source} cannot be broken from here")
        try:
            runner.harm(Harm(Faults(cut=frozenset(request.cut)), request.noise))
        except ModelError as error:
            raise WireError(str(error)) from None
        self._hub.tell(self.greeting())

    def _pose(self, page: Listener, request: SetPose) -> None:
        """Raise WireError where the source has no sheet to bend."""
        runner = self._hub.runner
        if not runner.bendable:
            raise WireError(f"{runner.source} cannot be bent from here")
        self._newest = request
        self._hub.keep(self._bring(page, request))

    async def _bring(self, page: Listener, request: SetPose) -> None:
        """Bend the sheet unless something newer is asked for already, and say how it lies."""
        async with self._posing:
            if request is self._newest:
                try:
                    made = posed(request, self._hub.runner.prepared.skin.surface)
                    await asyncio.to_thread(self._hub.runner.bend, made)
                except (GeometryError, WireError) as error:
                    page.post(_refused(error))
            self._hub.tell(self.greeting())


def _refused(error: GeometryError | WireError) -> str:
    hint = f" ({error.hint})" if error.hint else ""
    fields = {"type": "twin_refused", "message": error.message + hint}
    return msgspec.json.encode(fields).decode()
