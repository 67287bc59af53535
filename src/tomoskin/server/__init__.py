"""The page's server: what a page may ask, and what it is sent."""

from tomoskin.server.access import (
    AccessPolicy as AccessPolicy,
    is_loopback as is_loopback,
    load_token as load_token,
)
from tomoskin.server.handlers import serve_requests as serve_requests
from tomoskin.server.hub import Hub as Hub
from tomoskin.server.overview import Overview as Overview
from tomoskin.server.server import (
    DEFAULT_PORT as DEFAULT_PORT,
    Server as Server,
    application as application,
    check_page as check_page,
    listen as listen,
    robot_application as robot_application,
)
from tomoskin.server.views import state as state
