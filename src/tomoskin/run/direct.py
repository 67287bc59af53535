"""Commands that belong to this very moment, carried out by the thread that asks."""

from __future__ import annotations

from tomoskin.core import Event, ModelError, WireError
from tomoskin.run.commands import DirectCommand, Note, ReplayCommand
from tomoskin.run.flow import Flow
from tomoskin.run.marker import play
from tomoskin.run.twin_requests import SetPose, SetTwin


def do(flow: Flow, command: DirectCommand) -> None:
    """Carry out what any thread may do.

    Raises
    ------
    WireError
        For what the source cannot do or does not have.
    GeometryError
        For a shape that its sheet cannot take.
    """
    match command:
        case Note():
            newest = flow.newest
            host_time = newest.result.host_time if newest else flow.now()
            flow.out.put(Event(host_time, "note", command.text))
        case SetTwin():
            _break(flow, command)
        case SetPose():
            if not flow.twin.bendable:
                raise WireError(f"{flow.source} cannot be bent on the page")
            flow.twin.set_pose(command, flow.prepared.skin.surface)
        case _:
            _play(flow, command)


def _break(flow: Flow, command: SetTwin) -> None:
    if not flow.twin.breakable:
        raise WireError(f"{flow.source} cannot simulate faults")
    try:
        flow.twin.set_harm(command)
    except ModelError as error:
        raise WireError(str(error)) from None


def _play(flow: Flow, command: ReplayCommand) -> None:
    if flow.marker.replay is None:
        raise WireError(f"{flow.source} is not a replay")
    play(flow.marker.replay, command)
