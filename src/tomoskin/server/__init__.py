"""The page's server: what a page may ask, and what it is sent."""

from tomoskin.server.flows import take_flows
from tomoskin.server.hub import Hub
from tomoskin.server.messages import readings, stages
from tomoskin.server.security import Door, is_loopback
from tomoskin.server.server import (
    DEFAULT_PORT,
    STATIC,
    Server,
    ServerError,
    application,
    check_page,
    listen,
)
from tomoskin.server.settings import SettingsDesk
from tomoskin.server.token import kept_token
from tomoskin.server.twin import TwinDesk

__all__ = [
    "DEFAULT_PORT",
    "STATIC",
    "Door",
    "Hub",
    "Server",
    "ServerError",
    "SettingsDesk",
    "TwinDesk",
    "application",
    "check_page",
    "is_loopback",
    "kept_token",
    "listen",
    "readings",
    "stages",
    "take_flows",
]
