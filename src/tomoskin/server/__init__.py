"""The page's server: what a page may ask, and what it is sent."""

from tomoskin.server import page_messages as page_messages, robot_messages as robot_messages
from tomoskin.server.access import (
    AccessPolicy as AccessPolicy,
    is_loopback as is_loopback,
    load_token as load_token,
)
from tomoskin.server.guided_flow import Estimate as Estimate, GuidedFlow as GuidedFlow
from tomoskin.server.handlers import serve_requests as serve_requests
from tomoskin.server.hub import Hub as Hub
from tomoskin.server.page_connection import (
    Host as Host,
    Page as Page,
    Tasks as Tasks,
    during as during,
)
from tomoskin.server.page_messages import Figures as Figures, RubbedNow as RubbedNow
from tomoskin.server.press_flow import DotFlow as DotFlow
from tomoskin.server.press_taker import OFTEN as OFTEN, PressTaker as PressTaker
from tomoskin.server.requests import (
    AskPoint as AskPoint,
    LearnFlow as LearnFlow,
    SetRecording as SetRecording,
    StopLearning as StopLearning,
)
from tomoskin.server.server import (
    DEFAULT_PORT as DEFAULT_PORT,
    STATIC as STATIC,
    Server as Server,
    application as application,
    application_of_several as application_of_several,
    check_page as check_page,
    listen as listen,
)
from tomoskin.server.views import state as state
