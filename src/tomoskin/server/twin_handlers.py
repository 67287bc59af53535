"""Requests that bend, break and mend the twin."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence

import numpy as np

from tomoskin.core import TomoskinError, WireError
from tomoskin.run import SetPose, SetTwin, way_to_bend
from tomoskin.server.hub import Hub
from tomoskin.server.page_messages import text_of
from tomoskin.server.task import Listener


class TwinHandlers:
    """What is done to the twin beside pressing it, the same for all pages."""

    def __init__(self, hub: Hub) -> None:
        self._hub = hub
        self._newest: SetPose | None = None
        self._posing = asyncio.Lock()
        hub.serve({SetTwin: self._set, SetPose: self._pose}, self.greeting)

    def greeting(self) -> Sequence[str]:
        """What is wrong now, and how the sheet is bent."""
        twin, skin = self._hub.runner.twin, self._hub.runner.prepared.skin
        harm, asked = twin.harm, twin.pose.asked
        extent = np.ptp(skin.outline.polyline(skin.outline.length / 60), axis=0)
        text = text_of(
            type="twin",
            breakable=twin.breakable,
            cut=sorted(set(harm.cut)),
            noise=harm.noise,
            bendable=twin.bendable,
            bends=way_to_bend(skin.surface),
            bend=asked.bend,
            stretch=asked.stretch,
            size_m=float(extent.max()),
        )
        return (text,)

    def _set(self, _: Listener, request: SetTwin) -> None:
        """Raise WireError where the source is no twin, or has no such electrode."""
        self._hub.runner.ask(request)
        self._hub.tell(self.greeting())

    def _pose(self, page: Listener, request: SetPose) -> None:
        """Raise WireError where the source has no sheet to bend."""
        if not self._hub.runner.twin.bendable:
            raise WireError(f"{self._hub.runner.status().source} cannot be bent on the page")
        self._newest = request
        self._hub.tasks.keep(self._bring(page, request))

    async def _bring(self, page: Listener, request: SetPose) -> None:
        """Bend the sheet unless something newer is asked for already, and say how it lies."""
        async with self._posing:
            if request is self._newest:
                try:
                    await asyncio.to_thread(self._hub.runner.ask, request)
                except TomoskinError as error:
                    page.post(_refusal(error))
            self._hub.tell(self.greeting())


def _refusal(error: TomoskinError) -> str:
    hint = f" ({error.hint})" if error.hint else ""
    return text_of(type="twin_refused", message=error.message + hint)
