"""Which frames' touches are worth sending."""

from __future__ import annotations

from dataclasses import dataclass

from tomoskin.sink.sink import Moment


@dataclass
class TouchPace:
    """A touch that begins or ends is sent at once, what it does meanwhile every ``period`` s.

    Frames without touches are sent only after some, once: then the last touch has ended.
    """

    period: float = 0.0
    _ids: tuple[int, ...] = ()
    _last: float = float("-inf")

    def is_due(self, moment: Moment) -> bool:
        """Whether to send the touches of ``moment``; it counts as sent if so."""
        ids = tuple(touch.id for touch in moment.touches)
        if ids == self._ids:
            waited = moment.host_time - self._last
            if not ids or 0 <= waited < self.period:
                return False
        self._ids, self._last = ids, moment.host_time
        return True
