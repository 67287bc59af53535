"""The desks of the flows: files and replays, sources, presses where the dot is."""

from __future__ import annotations

from tomoskin.server.files import FilesDesk
from tomoskin.server.guide import GuideDesk
from tomoskin.server.hub import Hub
from tomoskin.server.sources import SourcesDesk
from tomoskin.server.stage import Stage


def take_flows(hub: Hub, source: str) -> None:
    """Let ``hub`` answer the flows' requests, before the first page; ``source``: the first one."""
    stage = Stage(hub, source)
    for desk in (FilesDesk(hub, stage), SourcesDesk(hub, stage), GuideDesk(hub)):
        hub.take(desk)
