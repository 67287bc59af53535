"""All that a page may ask, beside the commands to the run that the hub itself passes on."""

from __future__ import annotations

from tomoskin.server.files import FileHandlers
from tomoskin.server.guide import GuideHandlers
from tomoskin.server.hub import Hub
from tomoskin.server.settings import SettingsHandlers
from tomoskin.server.sources import SourceHandlers, SourceSwitch
from tomoskin.server.twin import TwinHandlers


def serve_requests(hub: Hub, source: str) -> None:
    """Let ``hub`` answer every request, before the first page comes; ``source``: the first one."""
    SettingsHandlers(hub)
    TwinHandlers(hub)
    switch = SourceSwitch(hub, source)
    FileHandlers(hub, switch)
    SourceHandlers(hub, switch)
    GuideHandlers(hub)
