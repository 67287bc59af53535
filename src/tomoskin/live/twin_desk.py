"""The desk that breaks and mends the twin."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import msgspec

from tomoskin.core import ModelError, WireError
from tomoskin.live.hub import Hub, Listener
from tomoskin.live.presses import Harm
from tomoskin.live.twin_requests import SetTwin
from tomoskin.twin import Faults


class TwinDesk:
    """What is wrong with the twin, the same for all pages."""

    def __init__(self, hub: Hub) -> None:
        self._hub = hub

    @property
    def handlers(self) -> Mapping[type, Callable[[Listener, Any], None]]:
        """See :class:`~tomoskin.live.hub.Desk`."""
        return {SetTwin: self._set}

    def greeting(self) -> Sequence[str]:
        """What is wrong now."""
        harm, runner = self._hub.runner.harmed, self._hub.runner
        fields = {
            "type": "twin",
            "breakable": runner.breakable,
            "cut": sorted(harm.faults.cut),
            "noise": harm.noise,
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
