"""The runner's thread: reads the source, opens it again when it is lost, goes over to another."""

from __future__ import annotations

import logging

from threadpoolctl import threadpool_limits

from tomoskin.core import TomoskinError
from tomoskin.pipeline import Prepared
from tomoskin.run.flow import Flow
from tomoskin.run.publisher import Audience
from tomoskin.run.wanted import Opener, Wanted
from tomoskin.source import Transport

_POLL = 0.05
_WAITING = "waiting for the board to answer"
_FIRST_DELAY, _LONGEST_DELAY = 0.25, 5.0

_log = logging.getLogger(__name__)


class Loop:
    """Follows one source after the other until nothing more is wanted.

    Attributes
    ----------
    flow
        The skin and source of the moment; another one after each change.
    open
        What opens its source.
    trouble
        Why no frames come, or None.
    """

    def __init__(
        self, prepared: Prepared, opener: Opener, wanted: Wanted, audience: Audience
    ) -> None:
        self.flow, self.open = Flow(prepared, audience), opener
        self.trouble: str | None = "not started"
        self._wanted, self._audience = wanted, audience

    def run(self, transport: Transport | None) -> None:
        """Follow ``transport``, and what comes after it; returns at the end."""
        try:
            # a frame's products are small: more threads would only wait for each other
            with threadpool_limits(1):
                while transport is not None:
                    self._follow(transport)
                    transport = self._following()
        except Exception as error:
            _log.exception("the live thread ended")
            self.trouble = f"internal error, {type(error).__name__}: {error}; start again"
            self.flow.out.say("internal", self.trouble)

    def _follow(self, transport: Transport) -> None:
        """Take frames until the source is lost or to be left."""
        flow, self.trouble = self.flow, _WAITING
        try:
            with flow.link(transport) as link:
                while not self._wanted.elsewhere:
                    self._take_over(flow)
                    flow.press(transport)
                    found = link.poll(_POLL)
                    self.trouble = None if link.running else _WAITING
                    flow.take(link, found)
        except TomoskinError as error:
            self.trouble = str(error)
            flow.out.say("source-lost", str(error))
        finally:
            flow.unlinked()

    def _take_over(self, flow: Flow) -> None:
        """Go on with other settings, where some are wanted."""
        if (settings := self._wanted.next_settings()) is not None:
            prepared, done = settings
            flow.adopt(prepared)
            done.set()

    def _following(self) -> Transport | None:
        """What is followed next: what was changed to, else the old one anew; None at the end."""
        delay = _FIRST_DELAY
        while not self._wanted.stopped:
            if (transport := self._changed()) is not None:
                return transport
            if self._wanted.wait(delay):
                continue
            try:
                return self.open()
            except TomoskinError as error:
                self.trouble = str(error)
                delay = min(2 * delay, _LONGEST_DELAY)
        return None

    def _changed(self) -> Transport | None:
        """Change to what is wanted, if anything is; None where it cannot be opened."""
        change = self._wanted.next_change()
        if change is None:
            return None
        try:
            transport = change.open()
        except TomoskinError as error:
            change.refused(error)
            return None
        self.flow.out.stop()
        self.flow, self.open = Flow(change.prepared, self._audience), change.open
        self.flow.opened(transport)
        change.done.set()
        return transport
