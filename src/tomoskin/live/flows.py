"""The desks of the flows: files and replays, sources, presses where the dot is."""

from __future__ import annotations

from tomoskin.live.files_desk import FilesDesk
from tomoskin.live.guide import GuideDesk
from tomoskin.live.hub import Hub
from tomoskin.live.sources_desk import SourcesDesk
from tomoskin.live.stage import Stage


def take_flows(hub: Hub, source: str) -> None:
    """Let ``hub`` answer the flows' requests, before the first page; ``source``: the first one."""
    stage = Stage(hub, source)
    for desk in (FilesDesk(hub, stage), SourcesDesk(hub, stage), GuideDesk(hub)):
        hub.take(desk)
