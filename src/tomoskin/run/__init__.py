"""The running loop: a thread that owns the source, commands to it and messages from it."""

from tomoskin.run.commands import (
    MAX_NOTE,
    Adopt,
    Change,
    Command,
    DirectCommand,
    HoldPresses,
    Note,
    QueuedCommand,
    Record,
    ReplayCommand,
    Seek,
    SetLoop,
    SetPause,
    SetSpeed,
    Step,
    StopRecording,
    TakeReference,
)
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
from tomoskin.run.marker import ReplaySource
from tomoskin.run.posing import SheetPose, sheet_pose, way_to_bend
from tomoskin.run.runner import Runner
from tomoskin.run.simulate import Simulated, simulate
from tomoskin.run.status import Status
from tomoskin.run.twin_control import Harm, TwinControl
from tomoskin.run.twin_requests import MAX_FORCE, SetPose, SetPresses, SetTwin, StrictRequest

__all__ = [
    "MAX_FORCE",
    "MAX_NOTE",
    "Adopt",
    "Change",
    "Command",
    "DirectCommand",
    "Harm",
    "HoldPresses",
    "Note",
    "QueuedCommand",
    "Record",
    "ReplayCommand",
    "ReplaySource",
    "Runner",
    "Seek",
    "SetLoop",
    "SetMade",
    "SetPause",
    "SetPose",
    "SetPresses",
    "SetSpeed",
    "SetTwin",
    "SheetPose",
    "Simulated",
    "Snapshot",
    "Status",
    "Step",
    "StopRecording",
    "StrictRequest",
    "TakeReference",
    "TwinControl",
    "Workers",
    "in_processes",
    "in_this_process",
    "make_set",
    "on_cluster",
    "processors",
    "sheet_pose",
    "simulate",
    "way_to_bend",
]
