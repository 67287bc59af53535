"""The running loop: a thread that owns the source, and all who are told what it makes."""

from tomoskin.run.flow import Snapshot
from tomoskin.run.labelled_frames import (
    SetMade,
    Workers,
    in_processes,
    in_this_process,
    make_set,
    on_cluster,
    processors,
)
from tomoskin.run.posing import posed, way_to_bend
from tomoskin.run.presses import Harm
from tomoskin.run.runner import Runner
from tomoskin.run.simulate import Simulated, simulate
from tomoskin.run.status import Status
from tomoskin.run.twin_requests import MAX_FORCE, SetPose, SetPresses, SetTwin, TwinRequest
from tomoskin.run.wishes import Replayed

__all__ = [
    "MAX_FORCE",
    "Harm",
    "Replayed",
    "Runner",
    "SetMade",
    "SetPose",
    "SetPresses",
    "SetTwin",
    "Simulated",
    "Snapshot",
    "Status",
    "TwinRequest",
    "Workers",
    "in_processes",
    "in_this_process",
    "make_set",
    "on_cluster",
    "posed",
    "processors",
    "simulate",
    "way_to_bend",
]
