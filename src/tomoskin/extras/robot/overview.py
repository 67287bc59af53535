"""The page of a whole robot: its skins in space, the touches on them, and how each is doing."""

from __future__ import annotations

import asyncio
import contextlib
import math
import time
from collections.abc import AsyncIterator, Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from starlette.types import ASGIApp

from tomoskin import __version__
from tomoskin.core import Amount, FloatArray, SkinError, WireError, encode_json
from tomoskin.extras.robot.robot_file import PlacedSkin, Robot
from tomoskin.extras.robot.robot_run import RobotRun
from tomoskin.files.messages import Contacts, Stream
from tomoskin.model.mesh import Pose
from tomoskin.run import FILE_NAME, StrictRequest, commands
from tomoskin.server import (
    STATIC,
    AccessPolicy,
    Host,
    Hub,
    Page,
    SetRecording,
    Tasks,
    application_of_several,
    during,
    robot_messages as to_page,
)

PERIOD = 1 / 20
"""Seconds between two looks at the touches."""

_STATES = 5
"""So many looks, and all states are sent."""


class Overview(Host):
    """What the pages of the whole robot are told, and may ask; lives in the event loop.

    Parameters
    ----------
    robot, run
        The robot, and what runs.
    folder
        Where recordings go, under names of their own.
    """

    def __init__(self, robot: Robot, run: RobotRun, folder: Path) -> None:
        super().__init__()
        self.run, self.folder = run, folder
        self._tasks = Tasks()
        placed = {skin.name: skin for skin in robot.skins}
        streams = {
            n: Stream.of(r.prepared, n, 0.0, placed[n].place) for n, r in run.runners.items()
        }
        self._stance, self._touches = Stance(robot), b""
        self._scene = scene(robot, streams)

    @contextlib.asynccontextmanager
    async def running(self) -> AsyncIterator[None]:
        """Look at the runs while the block lasts."""
        async with during(self._tick()):
            yield

    def first(self) -> tuple[to_page.RobotScene, to_page.RobotState]:
        """The robot, and how its skins are doing."""
        self._renew()  # while nobody looked it was not
        return self._scene, states(self.run)

    def newest(self) -> bytes | None:
        """The newest touches on all skins, JSON in bytes; None before the first."""
        return self._touches or None

    def leave(self, page: Page, why: str = "") -> None:
        """Stop serving ``page``, and say why in every run."""
        super().leave(page)
        if why:
            for runner in self.run.runners.values():
                runner.say("page-dropped", why)

    def obey(self, page: Page, request: StrictRequest) -> None:
        """Do what a page asks of all skins. Raises WireError where that cannot be."""
        match request:
            case commands.TakeReference():
                for runner in self.run.runners.values():
                    runner.submit(request)
            case SetRecording():
                work = partial(self._record, on=request.on)
                self._tasks.run(page, work, lambda _: self._tell())
            case _:
                raise WireError("this is possible only on the page of one skin")

    def _record(self, *, on: bool) -> None:
        if on:
            self.run.record(self.folder / time.strftime(FILE_NAME))
        else:
            self.run.stop_recording()

    def _tell(self) -> None:
        self.tell(states(self.run))

    async def _tick(self) -> None:
        count = 0
        while True:
            if self.pages:
                self._renew()
                if count % _STATES == 0:
                    self._tell()
                self.wake()
            count += 1
            await asyncio.sleep(PERIOD)

    def _renew(self) -> None:
        """Take the newest results; the same object where nothing has changed."""
        newest = {n: r.contacts for n, r in self.run.runners.items() if r.newest}
        poses = self._stance.poses(max((c.utc or 0.0 for c in newest.values()), default=0.0))
        skins = {name: _on(contacts, poses) for name, contacts in newest.items()}
        made = encode_json(to_page.RobotTouches(skins=skins, poses=_flat(poses)))
        if made != self._touches:
            self._touches = made


class Stance:
    """Where the links of a ``robot`` are drawn.

    A joint is where its newest state says; else where it was last, and at zero before that. One
    that mimics another follows it. Where a pose cannot be told, all is drawn as it was last.
    """

    def __init__(self, robot: Robot) -> None:
        self._urdf, self._joints = robot.urdf, robot.skins[0].place.joints
        self._last: dict[str, float] = {}
        self._drawn = self._urdf.poses() if self._urdf else {}
        self._follow = (
            {j.name for j in self._urdf.joints.values() if j.mimics} if self._urdf else ()
        )

    def poses(self, utc: float) -> dict[str, Pose]:
        """Of each link in the frame of the root at a time, s since 1970."""
        if self._urdf is None or self._joints is None:
            return self._drawn
        with contextlib.suppress(SkinError):
            self._drawn = self._urdf.poses(partial(self._position, self._joints(utc)))
        return self._drawn

    def _position(self, positions: Callable[[str], float], joint: str) -> float:
        if joint in self._follow:
            raise SkinError(f'the joint "{joint}" follows another')
        with contextlib.suppress(SkinError):
            self._last[joint] = positions(joint)
        return self._last.get(joint, 0.0)


def _on(contacts: Contacts, poses: Mapping[str, Pose]) -> to_page.TouchesOfSkin:
    pose = poses.get(contacts.frame_id, Pose())
    return to_page.TouchesOfSkin(
        valid=contacts.valid,
        pose_problem=contacts.link.problem if contacts.link else None,
        touches=[
            to_page.SpaceTouch(
                id=contact.touch.id,
                position=_rounded(pose(np.array([contact.position]))[0]),
                normal=_rounded(pose.rotation @ contact.normal),
                peak=contact.touch.detection.peak,
                force=None if math.isnan(contact.force) else contact.force,
                more_than=_more_than(contact.touch.detection.force),
                is_self=contact.is_self,
            )
            for contact in contacts.touches
        ],
    )


def scene(robot: Robot, streams: Mapping[str, Stream]) -> to_page.RobotScene:
    """Links and skins, each in its own frame, m; coordinates lie flat as x0, y0, z0, …

    Where a link is shown by its shape no bone is, and what cannot be shown is said.
    """
    urdf = robot.urdf
    solids = urdf.solids() if urdf else ()
    shown = {solid.link: solid.triangles for solid in solids if len(solid.triangles)}
    number = {link: k for k, link in enumerate(urdf.links)} if urdf else {}
    bones = urdf.bones(without=shown) if urdf else ()
    return to_page.RobotScene(
        name=robot.name,
        bones=[number[link] for ends in bones for link in ends],
        links=[
            to_page.DrawnLink(number[n], _rounded(corners.ravel())) for n, corners in shown.items()
        ],
        undrawn=[f"{solid.link}: {why}" for solid in solids for why in solid.problems],
        skins=[_skin(s, streams[s.name], number.get(s.place.link)) for s in robot.skins],
        poses=_flat(urdf.poses()) if urdf else [],
        version=__version__,
    )


def _skin(skin: PlacedSkin, stream: Stream, link: int | None) -> to_page.PlacedShape:
    corners = np.zeros(0) if stream.corners is None else stream.corners.ravel()
    frame = stream.naming.frame_id
    return to_page.PlacedShape.of(skin, frame=frame, link=link, corners=_rounded(corners))


def _flat(poses: Mapping[str, Pose]) -> Any:
    """Three rows of four numbers of each."""
    rows = [np.column_stack([pose.rotation, pose.position]).ravel() for pose in poses.values()]
    return _rounded(np.concatenate([np.zeros(0), *rows]))


def states(run: RobotRun) -> to_page.RobotState:
    """The state of each skin, in words."""
    skins = {
        name: to_page.SkinState.of(
            status,
            ready=status.reference.ready,
            lost=status.dropped + status.gaps,
            p99_ms=1e3 * status.p99,
        )
        for name, status in run.statuses().items()
    }
    recording = None if run.recording is None else run.recording.name
    return to_page.RobotState(skins=skins, recording=recording)


def _more_than(force: Amount | None) -> float | None:
    return force.low if force is not None and math.isinf(force.high) else None


def _rounded(values: FloatArray) -> Any:
    """To 0.01 mm, which nobody sees."""
    return np.round(values, 5).tolist()


def robot_application(
    overview: Overview, hubs: Mapping[str, Hub], policy: AccessPolicy, static: Path = STATIC
) -> ASGIApp:
    """ASGI application: the page of the whole robot, and those of its skins."""
    state = partial(_state, overview.run)
    return application_of_several(overview, state, hubs, policy, static / "robot.html")


def _state(run: RobotRun) -> str:
    return states(run).json
