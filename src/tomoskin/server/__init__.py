"""The page's server: what a page may ask, and what it is sent."""

from tomoskin.server.access import AccessPolicy, is_loopback, load_token
from tomoskin.server.handlers import serve_requests
from tomoskin.server.hub import Hub
from tomoskin.server.overview import Overview
from tomoskin.server.server import (
    DEFAULT_PORT,
    Server,
    application,
    check_page,
    listen,
    robot_application,
)
from tomoskin.server.views import state

__all__ = [
    "DEFAULT_PORT",
    "AccessPolicy",
    "Hub",
    "Overview",
    "Server",
    "application",
    "check_page",
    "is_loopback",
    "listen",
    "load_token",
    "robot_application",
    "serve_requests",
    "state",
]
