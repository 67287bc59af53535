"""Requests that are commands to the run: presses, pause, reference, notes, recording, replay."""

from __future__ import annotations

import asyncio
import time
from functools import partial
from pathlib import Path
from typing import get_args

import numpy as np

from tomoskin.core import DataError, GeometryError, TomoskinError, WireError
from tomoskin.model.skin import Skin
from tomoskin.pipeline import Unresolved
from tomoskin.run import Runner, SetPresses, commands
from tomoskin.server.page_connection import Handlers, Listener, Tasks
from tomoskin.server.page_messages import UnresolvedMap
from tomoskin.server.requests import AskUnresolved, Painted, SetRecording
from tomoskin.twin import Contact

FILE_NAME = "tomoskin-%Y%m%d-%H%M%S.mcap"
"""Of a recording that is asked for on a page, for ``time.strftime``."""


def run_handlers(runner: Runner, folder: Path, tasks: Tasks) -> Handlers:
    """Handlers of a run whose recordings go to ``folder``, under names of their own."""

    def submit(_: Listener, request: commands.Command) -> None:
        runner.submit(request)

    def press(page: Listener, request: SetPresses) -> None:
        runner.submit(commands.HoldPresses(page, _on_skin(request, runner.prepared.skin)))

    def paint(page: Listener, request: Painted) -> None:
        runner.latency.set_paint(page, request.p50_s, request.p99_s)

    def record(_: Listener, request: SetRecording) -> None:
        tasks.keep(_record(runner, folder, on=request.on))

    def map_out(page: Listener, _: AskUnresolved) -> None:
        tasks.run(page, partial(_unresolved, runner), lambda found: page.post(found.json))

    def play(page: Listener, request: commands.ReplayCommand) -> None:
        tasks.run(page, partial(runner.ask, request), lambda _: None)  # a seek may read a file

    return {
        commands.TakeReference: submit,
        commands.SetPause: submit,
        commands.Note: submit,
        SetPresses: press,
        Painted: paint,
        AskUnresolved: map_out,
        SetRecording: record,
        **dict.fromkeys(get_args(commands.ReplayCommand), play),
    }


def _unresolved(runner: Runner) -> UnresolvedMap:
    """What the data of this moment cannot tell."""
    newest, prepared = runner.newest, runner.prepared
    health = newest.result.health if newest else None
    lost = np.zeros(prepared.pattern.n_meas, bool) if health is None else health.lost
    try:
        found = Unresolved.of(prepared, runner.status().choice.alpha, np.flatnonzero(lost))
    except TomoskinError as error:
        return UnresolvedMap(values=None, radius_m=0.0, problem=error.message)
    return UnresolvedMap(values=found.values.round(3).tolist(), radius_m=found.radius, problem="")


async def _record(runner: Runner, folder: Path, *, on: bool) -> None:
    begin = commands.Record(folder / time.strftime(FILE_NAME))
    try:
        await asyncio.wrap_future(runner.submit(begin if on else commands.StopRecording()))
    except DataError as error:
        runner.say("recording-stopped", f"the recording did not start: {error}")


def _on_skin(request: SetPresses, skin: Skin) -> tuple[Contact, ...]:
    """A finger that has slid off the sheet presses nothing; WireError for no face at all."""
    asked = request.presses
    if not asked:
        return ()
    inside = skin.outline.contains(np.array([(p.x, p.y) for p in asked]))
    try:
        return tuple(p.contact for p, on in zip(asked, inside, strict=True) if on)
    except GeometryError as error:
        raise WireError(str(error)) from None
