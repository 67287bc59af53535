"""The desk that lists what can be connected, says what the board is, and connects."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from functools import partial
from typing import Any

from tomoskin.server.flow_requests import Connect, ListSources
from tomoskin.server.hub import Hub, Listener
from tomoskin.server.stage import Offer, Stage
from tomoskin.server.task import run_errand, text_of
from tomoskin.wire import SCHEMA


class SourcesDesk:
    """Connects the sources of a list, and no others: a page gives no path and no address."""

    def __init__(self, hub: Hub, stage: Stage) -> None:
        self._hub, self._stage = hub, stage

    @property
    def handlers(self) -> Mapping[type, Callable[[Listener, Any], None]]:
        """See :class:`~tomoskin.server.hub.Desk`."""
        return {ListSources: self._list, Connect: self._connect}

    def greeting(self) -> Sequence[str]:
        """Nothing: ports are looked for when someone asks."""
        return ()

    def _list(self, page: Listener, _: ListSources) -> None:
        def answer(offers: list[Offer]) -> None:
            page.post(self._told(offers))

        run_errand(self._hub, page, self._stage.offers, answer)

    def _connect(self, page: Listener, request: Connect) -> None:
        run_errand(
            self._hub,
            page,
            partial(self._stage.connect, request.source),
            lambda _: self._hub.show(),
        )

    def _told(self, offers: list[Offer]) -> str:
        runner = self._hub.runner
        return text_of(
            type="sources",
            sources=[asdict(offer) for offer in offers],
            current=self._stage.spec,
            host_protocol=f"{SCHEMA.major}.{SCHEMA.minor}",
            board=_board(runner.board),
            problem=runner.status().problem,
        )


def _board(info: Any) -> dict[str, Any] | None:
    if info is None:
        return None
    return {
        "firmware": ".".join(map(str, info.firmware)),
        "protocol": f"{info.major}.{info.minor}",
        "channels": info.channels,
        "adc_bits": info.adc_bits,
        "current_ma": info.current / 1e3,
        "unique_id": info.unique_id.hex(),
    }
