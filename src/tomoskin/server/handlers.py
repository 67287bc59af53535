"""All that a page may ask, beside the commands to the run that the hub itself passes on."""

from __future__ import annotations

from tomoskin.server.calibration_handlers import CalibrationHandlers
from tomoskin.server.file_handlers import FileHandlers
from tomoskin.server.guide_handlers import GuideHandlers
from tomoskin.server.hub import Hub
from tomoskin.server.settings_handlers import SettingsHandlers
from tomoskin.server.source_handlers import SourceHandlers, SourceSwitch
from tomoskin.server.twin_handlers import TwinHandlers


def serve_requests(hub: Hub, source: str) -> None:
    """Let ``hub`` answer every request, before the first page comes; ``source``: the first one."""
    SettingsHandlers(hub)
    TwinHandlers(hub)
    switch = SourceSwitch(hub, source)
    FileHandlers(hub, switch)
    SourceHandlers(hub, switch)
    GuideHandlers(hub, CalibrationHandlers(hub))
