"""The running pipeline, and the server of its page."""

from tomoskin.live.changes import DOUBTED, Changes, Idle, changes_of
from tomoskin.live.exports import WRITERS, Export
from tomoskin.live.finding import voltage_covariance
from tomoskin.live.flow import Snapshot
from tomoskin.live.flows import take_flows
from tomoskin.live.hub import Hub
from tomoskin.live.labelled import (
    SetMade,
    Workers,
    in_processes,
    in_this_process,
    make_set,
    on_cluster,
    processors,
)
from tomoskin.live.messages import readings, stages
from tomoskin.live.offline import Reconstruction, reconstruct
from tomoskin.live.pipeline import Pipeline
from tomoskin.live.prepare import Prepared, prepare, prepare_again
from tomoskin.live.replayed import advance, as_recorded, replayed
from tomoskin.live.result import Result
from tomoskin.live.runner import Runner
from tomoskin.live.scale import colour_limit
from tomoskin.live.security import Door, is_loopback
from tomoskin.live.server import (
    DEFAULT_PORT,
    STATIC,
    Server,
    ServerError,
    application,
    check_page,
    listen,
)
from tomoskin.live.settings import SettingsDesk
from tomoskin.live.simulate import Simulated, simulate
from tomoskin.live.status import Status
from tomoskin.live.token import kept_token
from tomoskin.live.twin_desk import TwinDesk

__all__ = [
    "DEFAULT_PORT",
    "DOUBTED",
    "STATIC",
    "WRITERS",
    "Changes",
    "Door",
    "Export",
    "Hub",
    "Idle",
    "Pipeline",
    "Prepared",
    "Reconstruction",
    "Result",
    "Runner",
    "Server",
    "ServerError",
    "SetMade",
    "SettingsDesk",
    "Simulated",
    "Snapshot",
    "Status",
    "TwinDesk",
    "Workers",
    "advance",
    "application",
    "as_recorded",
    "changes_of",
    "check_page",
    "colour_limit",
    "in_processes",
    "in_this_process",
    "is_loopback",
    "kept_token",
    "listen",
    "make_set",
    "on_cluster",
    "prepare",
    "prepare_again",
    "processors",
    "readings",
    "reconstruct",
    "replayed",
    "simulate",
    "stages",
    "take_flows",
    "voltage_covariance",
]
