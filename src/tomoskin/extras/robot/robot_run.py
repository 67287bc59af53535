"""All skins of a robot in one program: a run each, one clock, one recording, one watch."""

from __future__ import annotations

import threading
from collections.abc import Mapping, Sequence
from concurrent.futures import wait
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from time import monotonic
from typing import Self

from tomoskin.board.source import open_source
from tomoskin.core import StrPath, TomoskinError
from tomoskin.extras.robot.moving_link import PlaceOnRobot
from tomoskin.extras.robot.robot_file import PlacedSkin, Robot
from tomoskin.files.messages import epoch
from tomoskin.files.session import MessageLog, robot_logs
from tomoskin.model.skin import Skin
from tomoskin.pipeline import Prepared, prepare, with_calibrations
from tomoskin.run import LiveSkin, Opener, Runner, Status, Turns, commands
from tomoskin.run.sinks import Sink, make_sink

_OFTEN = 0.25
"""Seconds between two looks at all runs."""

_STEP = 0.1
"""Seconds by which the time of the day may move against the monotonic clock."""


@dataclass(frozen=True, slots=True)
class Member:
    """One skin of the robot: what its run is made of; ``board``: the unique id that its board must
    have, hexadecimal, or None."""

    place: PlaceOnRobot
    prepared: Prepared
    open: Opener
    sinks: Sequence[Sink] = ()
    board: str | None = None

    @classmethod
    def of(cls, placed: PlacedSkin, skin: Skin, sinks: Sequence[Sink]) -> Self:
        """The ``skin`` that a robot file has ``placed``, with the calibrations that it names there.

        Raises TomoskinError.
        """
        prepared = with_calibrations(prepare(skin), placed.calibrations)
        return cls(
            placed.place, prepared, partial(open_source, placed.source, skin), sinks, placed.board
        )


class RobotRun(AbstractContextManager["RobotRun"]):
    """Runs the skins of a robot.

    Each has a thread that reads its board; they compute in turns, so that none disturbs another.
    A board that is missing at the start, or lost later, is sought on; the others go on.

    Attributes
    ----------
    runners, skins
        By the names of the skins, in their order: what runs each, and what a program reads.
    """

    def __init__(self, members: Sequence[Member], *, early: bool = False) -> None:
        turns = Turns()
        self.runners: Mapping[str, Runner] = {
            m.place.name: Runner(
                m.prepared,
                m.open,
                sinks=m.sinks,
                robot=(m.place, turns),
                early=early,
            )
            for m in members
        }
        self.skins = {name: LiveSkin(runner) for name, runner in self.runners.items()}
        self._boards = {m.place.name: m.board for m in members}
        self._unmarked = {m.place.name: m.place.unmarked for m in members}
        self._problems: Mapping[str, str] = {}
        self._logs: Mapping[str, MessageLog] = {}
        self._ended = threading.Event()
        self._watch = threading.Thread(target=self._look_on, name="tomoskin-robot", daemon=True)

    def __exit__(self, *_: object) -> None:
        """Stop the boards and end the runs."""
        self.stop()

    def start(self) -> None:
        """Open the sources and begin.

        Raises
        ------
        SourceError
            When none of the sources can be opened.
        """
        started = [runner.start(patient=True) for runner in self.runners.values()]
        missing = [error for error in started if error is not None]
        if len(missing) == len(started):
            self.stop()
            raise missing[0]
        for name, text in self._unmarked.items():
            if text:
                self.runners[name].say("self-contacts-unknown", text)
        self._watch.start()

    def stop(self) -> None:
        """Stop all boards and end; returns when it is done. A second call does nothing."""
        self._ended.set()
        if self._watch.ident is not None:
            self._watch.join()
        for runner in self.runners.values():
            runner.stop()
        self._close_log()

    def record(self, path: StrPath) -> None:
        """Record all skins to one new file, from now on.

        Raises
        ------
        OutputError, DataError
            When it exists or cannot be made.
        """
        path = Path(path)
        self.stop_recording()
        logs = self._logs = robot_logs(path, tuple(self.runners), epoch=epoch(), start=monotonic())
        asked = [r.submit(commands.Record(path, logs[n])) for n, r in self.runners.items()]
        try:
            for future in asked:
                future.result()
        except TomoskinError:
            self.stop_recording()
            raise

    def stop_recording(self) -> None:
        """End the recording, if there is one; returns when the file is complete."""
        if self._logs:
            wait([r.submit(commands.StopRecording()) for r in self.runners.values()])
        self._close_log()

    @property
    def recording(self) -> Path | None:
        """The file that is being recorded to, or None."""
        return next((log.path for log in self._logs.values()), None)

    def statuses(self) -> dict[str, Status]:
        """How each skin is doing now, by its name."""
        problems = self._problems
        statuses = {}
        for name, runner in self.runners.items():
            status = runner.status()
            problem = status.problem or problems.get(name)
            statuses[name] = replace(status, problem=problem, source=status.source or name)
        return statuses

    def _close_log(self) -> None:
        logs, self._logs = self._logs, {}
        for log in logs.values():
            with suppress(TomoskinError):  # whoever wrote last has said so
                log.close()

    def _look_on(self) -> None:
        """What no run can see by itself."""
        begun = epoch()
        while not self._ended.wait(_OFTEN):
            boards = {name: r.flow.board for name, r in self.runners.items()}
            ids = {name: board.unique_id.hex() for name, board in boards.items() if board}
            problems = board_problems(ids, self._boards)
            for name, text in problems.items():
                if self._problems.get(name) != text:
                    self.runners[name].say("wrong-board", text)
            self._problems = problems
            if abs(step := epoch() - begun) > _STEP:
                begun += step
                for runner in self.runners.values():
                    runner.say("clock-step", _STEPPED.format(step))


def open_robot(file: StrPath, sinks: Sequence[str] = ()) -> RobotRun:
    """All skins of a robot file, running; ``sinks`` as for :func:`open_skin`.

    A board that is missing is sought on, and its skin is not valid until it comes.

    Raises
    ------
    TomoskinError
        When the file, a skin or a calibration cannot be used, or no source at all can be opened.
    """
    members = [
        Member.of(placed, Skin.load(placed.skin), [*map(make_sink, sinks)])
        for placed in with_joints(Robot.load(file)).skins
    ]
    run = RobotRun(members)
    run.start()
    return run


def with_joints(robot: Robot) -> Robot:
    """The same, whose skins know where their links are where the file names joint states.

    Raises TomoskinError.
    """
    from tomoskin.extras.ros2 import joint_states

    return robot.moved_by(joint_states(robot.joints)) if robot.joints else robot


_STEPPED = "the clock of this computer was set by {:+.1f} s: messages keep the time of the start"


def board_problems(ids: Mapping[str, str], wanted: Mapping[str, str | None]) -> dict[str, str]:
    """What is wrong with the boards' unique ids, in a sentence, by the names of the skins.

    Boards without a number have zeros only, and cannot be told apart.
    """
    problems = {}
    for name, number in ids.items():
        others = [o for o, n in ids.items() if n == number and o != name and n.strip("0")]
        if wanted.get(name) not in (None, number):
            problems[name] = (
                f"board {number} answers, expected {wanted[name]}: check whether two "
                "cables are swapped"
            )
        elif others:
            problems[name] = (
                f"its board {number} has the same id as that of {', '.join(others)}: give it "
                "another (tomoskin firmware configure PORT --id NAME)"
            )
    return problems
