"""Requests that change the skin's settings while it runs, take changes back, save and load."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any, get_args

from tomoskin.core import (
    Output,
    SkinError,
    SourceError,
    TomoskinError,
    check_outputs,
    reach,
    watch_stages,
    write_text,
)
from tomoskin.imaging import LightTouch, LinearProblem, Spectrum
from tomoskin.model.skin import Skin
from tomoskin.pipeline import Prepared, colour_limit, prepare, tuned_image
from tomoskin.run import Runner, commands
from tomoskin.server import requests, settings_messages as messages
from tomoskin.server.hub import Hub
from tomoskin.server.page_connection import Page
from tomoskin.server.page_messages import Message

STAGES = get_args(messages.StageName)
"""What a change of settings comes to, one after the other; many begin later, or end earlier."""

MOST_KEPT = 100
"""Changes that can be taken back."""

_GESTURE = 1.0
"""Changes of the same keys within so many s are one, as of a slider that is drawn."""


_log = logging.getLogger(__name__)


class _SupersededError(Exception):
    """Something newer is asked for."""


class History:
    """Skins as they were before changes, and those that were taken back."""

    def __init__(self) -> None:
        self.past: list[Skin] = []
        self.future: list[Skin] = []
        self._last: tuple[object, float] = (None, 0.0)

    def add(self, skin: Skin, keys: object = None, now: float = 0.0) -> None:
        """Keep ``skin`` before a change, unless the change goes on with a gesture.

        ``keys`` are those that change at ``now`` s, None where it is no gesture.
        """
        last, then = self._last
        if keys is None or last != keys or now - then > _GESTURE:
            self.past.append(skin)
            del self.past[:-MOST_KEPT]
            self.future.clear()
        if keys is not None:
            self._last = keys, now

    def undo(self, present: Skin) -> Skin | None:
        """The skin before the newest change, None where there is none."""
        return self._move(present, self.past, self.future)

    def redo(self, present: Skin) -> Skin | None:
        """The skin that was taken back last, None where there is none."""
        return self._move(present, self.future, self.past)

    def _move(self, present: Skin, back: list[Skin], forth: list[Skin]) -> Skin | None:
        if not back:
            return None
        forth.append(present)
        self._last = None, 0.0
        return back.pop()


class AutomaticAlpha:
    """The alpha that would be chosen by the noise, for the mark on the slider."""

    def __init__(self) -> None:
        self._chooser: tuple[LinearProblem, LightTouch] | None = None

    def remember(self, prepared: Prepared) -> None:
        """Make ready to choose for what is prepared; takes a moment."""
        problem = prepared.problem
        if prepared.light_touch is not None:
            self._chooser = problem, prepared.light_touch
        elif prepared.skin.inverse.method == "one-step" and (
            self._chooser is None or self._chooser[0] is not problem
        ):
            self._chooser = problem, LightTouch.of(Spectrum.of(problem))

    def of(self, runner: Runner) -> float | None:
        """What would be chosen now; None where that cannot be said yet."""
        if runner.prepared.light_touch is not None:
            return runner.flow.pipeline.choice.alpha
        if self._chooser is None or self._chooser[0] is not runner.prepared.problem:
            return None
        reference, noise = runner.flow.pipeline.reference, runner.prepared.predicted_noise()
        if reference is not None and reference.noise_is_known and reference.noise.any():
            noise = runner.prepared.difference_noise(reference)
        return self._chooser[1](noise).alpha


class SettingsHandlers:
    """Settings of the runner's skin, the same for all pages; lives in the event loop.

    What the picture alone rests on is prepared in a thread and taken over between two frames;
    for anything else the source is opened again, as the twin and a board must follow it.
    """

    def __init__(self, hub: Hub) -> None:
        self._hub = hub
        self._asked: Skin = hub.runner.prepared.skin
        self._history = History()
        self._working = False
        self._stage: str | None = None
        self._took: float | None = None
        self._automatic = AutomaticAlpha()
        hub.serve(
            {
                requests.SetSettings: self._set,
                requests.UndoSettings: lambda page, _: self._step(page, self._history.undo),
                requests.RedoSettings: lambda page, _: self._step(page, self._history.redo),
                requests.SaveSkin: self._save,
                requests.LoadSkin: self._load,
                requests.AskPattern: self._pattern,
            },
            self.greeting,
        )

    def greeting(self) -> tuple[Message, ...]:
        """The schema, the settings as they are, and how far a change is."""
        return (messages.schema(), self._message(), _progress(self._stage))

    def _set(self, page: Page, request: requests.SetSettings) -> None:
        keys = sorted((s, k) for s, keys in request.changes.items() for k in keys)
        with _refusals_to(page):
            skin = messages.altered(self._present(), request.changes)
            self._check(skin)
            self._history.add(self._present(), keys, time.monotonic())
            self._go(page, skin)

    def _step(self, page: Page, step: Callable[[Skin], Skin | None]) -> None:
        """Go on with what a ``step`` through the history gives, where there is one."""
        if (skin := step(self._present())) is not None:
            self._go(page, skin)

    def _load(self, page: Page, request: requests.LoadSkin) -> None:
        path = self._hub.folder.path / f"{request.name}.toml"
        with _refusals_to(page):
            skin = Skin.load(path if path.is_file() else request.name)
            self._check(skin)
            self._history.add(self._present())
            self._go(page, skin)

    def _save(self, page: Page, request: requests.SaveSkin) -> None:
        name = f"{request.name}.toml"
        with _refusals_to(page, where=name):  # the page is told names, never paths
            _save(self._hub.folder.path / name, self._present(), replace=request.replace)
            self._hub.runner.say("saved", f"settings saved as {name}")
            self._hub.tell(self._message())

    def _pattern(self, page: Page, request: requests.AskPattern) -> None:
        with _refusals_to(page):
            page.post(messages.table_of(request.name, self._present().n_electrodes).json)

    def _present(self) -> Skin:
        """The settings as they are, or will be when what is being prepared is ready."""
        return self._asked if self._working else self._hub.runner.prepared.skin

    def _check(self, skin: Skin) -> None:
        """Raise SourceError where the source cannot follow ``skin``."""
        if skin.body == self._hub.runner.prepared.skin.body:
            return
        if self._hub.runner.flow.marker.replay is not None:
            raise SourceError(
                "a recording keeps its sheet and its scan: go back to live to change them"
            )
        if self._hub.opener is None:
            raise SourceError("this source cannot change its sheet or scan while it runs")

    def _go(self, page: Page, skin: Skin) -> None:
        self._asked = skin
        if not self._working:
            self._working = True
            self._hub.tasks.keep(self._work(page))
        self._hub.tell(self._message())

    async def _work(self, page: Page) -> None:
        """Prepare what is wanted until nothing newer is; what fails is taken back."""
        skin = None
        while skin is not self._asked:
            skin = self._asked
            try:
                with watch_stages(self._watcher(skin)):
                    await self._follow(skin)
            except _SupersededError:
                continue
            except TomoskinError as error:
                page.post(messages.refusal(error).json)
            except Exception as error:  # the next change is none the worse for it
                _log.exception("settings could not be prepared")
                internal = SkinError(f"internal error, {type(error).__name__}: {error}")
                page.post(messages.refusal(internal).json)
        self._working, self._stage = False, None
        self._hub.tell(self._message())

    async def _follow(self, skin: Skin) -> None:
        """Go on with ``skin``, and tell every page."""
        scaled = await asyncio.to_thread(self._bring, skin)
        if scaled is None:
            self._hub.show()
        else:
            self._hub.rescale(*scaled)
        await asyncio.to_thread(self._automatic.remember, self._hub.runner.prepared)

    def _watcher(self, skin: Skin) -> Callable[[str], None]:
        """Tells every page which stage the change to ``skin`` has come to, from any thread."""
        loop = asyncio.get_running_loop()

        def watch(stage: str) -> None:
            if skin is not self._asked:
                raise _SupersededError
            if stage:
                self._stage = stage
                loop.call_soon_threadsafe(self._hub.tell, _progress(stage))

        return watch

    def _bring(self, skin: Skin) -> tuple[Prepared, float] | None:
        """Prepare ``skin`` and have the runner go on with it; in a thread.

        What it was prepared to and the end of its scale; None where the source was opened again.
        """
        start, runner, opener = time.monotonic(), self._hub.runner, self._hub.opener
        prepared = prepare(skin, runner.prepared)
        prepared.warm_up()
        if skin.body == runner.prepared.skin.body:
            if runner.flow.pipeline.reference is not None:
                prepared = tuned_image(prepared, runner.flow.pipeline.reference)
            scaled = prepared, colour_limit(prepared)
            self._took = time.monotonic() - start
            runner.ask(commands.Adopt(prepared))
            return scaled
        if opener is None:
            raise SourceError("this source cannot change its sheet or scan while it runs")
        reach("source")
        _change(runner, prepared, partial(opener, skin))
        self._took = time.monotonic() - start
        return None

    def _message(self) -> messages.Settings:
        skin = self._present()
        return messages.Settings(
            document=skin.document,
            n_electrodes=skin.n_electrodes,
            automatic_alpha=self._automatic.of(self._hub.runner),
            alpha=self._hub.runner.flow.pipeline.choice.alpha,
            undo=len(self._history.past),
            redo=len(self._history.future),
            busy=self._working,
            took_ms=None if self._took is None else 1e3 * self._took,
            files=self._hub.folder.skins(),
            builtin=Skin.names(),
        )


@contextlib.contextmanager
def _refusals_to(page: Page, where: str = "") -> Iterator[None]:
    """Send what the block refuses to a page; as said of ``where``, if that is given."""
    try:
        yield
    except TomoskinError as error:
        named = type(error)(error.message, where=where, hint=error.hint) if where else error
        page.post(messages.refusal(named).json)


def _progress(stage: Any) -> messages.Progress:
    """How far a change is; None: nothing is being changed."""
    done = 0 if stage is None else STAGES.index(stage)
    return messages.Progress(stage=stage, done=done, stages=len(STAGES))


def _change(runner: Runner, prepared: Prepared, open_source: commands.Opener) -> None:
    """Go on with another sheet.

    A source that is pressed from here is simulated: it is opened beside the old one, which goes on
    meanwhile. Anything else may be the same port.
    """
    if not runner.flow.twin.pressable:
        runner.ask(commands.Change(prepared, open_source))
        return
    ahead = [open_source()]
    try:
        change = commands.Change(prepared, lambda: ahead.pop() if ahead else open_source())
        runner.ask(change)
    finally:
        for unused in ahead:
            unused.close()


def _save(path: Path, skin: Skin, *, replace: bool) -> None:
    if "file" in skin.document["surface"]:
        raise SkinError(
            "a skin on a scanned surface cannot be saved here, because it needs its surface "
            "file: edit its skin file"
        )
    if path.is_symlink():
        raise SkinError(
            "is a link, and tomoskin does not write through links", hint="choose another name"
        )
    check_outputs([Output(path)], overwrite=replace, consent="save again")
    write_text(path, skin.to_toml(), overwrite=replace)
