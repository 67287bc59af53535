"""A skin that runs, as a control loop reads it: the newest contacts, and nothing that waits."""

from __future__ import annotations

import os
import threading
from collections.abc import Iterable, Sequence
from contextlib import AbstractContextManager
from functools import partial

from tomoskin.board.source import open_source
from tomoskin.core import SkinError, StrPath
from tomoskin.files.session import SessionReader, as_recorded, parse_replay
from tomoskin.model.skin import Skin
from tomoskin.pipeline import Prepared, prepare, with_calibrations
from tomoskin.run.runner import Runner
from tomoskin.run.sinks import Contacts, make_sink

MAX_AGE = 0.5
"""Seconds after which a frame says nothing of the skin any more."""


class LiveSkin(AbstractContextManager["LiveSkin"]):
    """The newest contacts of a skin that runs; may be used from any thread.

    A thread of the run reads the board and computes. Nothing of it waits for who reads here, and
    nothing is kept for them: who is slow misses frames, and gets the newest.

    Attributes
    ----------
    runner
        What runs it: recording, a new reference, the state, and all else that can be asked of it.
    max_age
        Seconds after which a frame is not valid any more; SkinError unless it is more than 0.
    """

    def __init__(self, runner: Runner, max_age: float = MAX_AGE) -> None:
        self.runner, self.max_age, self._closed = runner, _checked_age(max_age), False
        self._news = threading.Condition()
        self._mine = threading.local()

    def __exit__(self, *_: object) -> None:
        """Stop the board and end the run."""
        self.close()

    def latest(self) -> Contacts:
        """The newest contacts; never waits.

        They are not valid, with the reason in ``problem``, before the untouched skin has been
        measured, while no frames come, and where the newest frame is older than ``max_age``.
        """
        self._mine.given = news = self.runner.news
        contacts = self.runner.contacts_of(news)
        if self._closed:
            return contacts.outdated("the skin has been closed")
        if contacts.valid and contacts.age_s > self.max_age:
            played = self.runner.flow.played
            ended = "the replay has ended" if played and played.ended else ""
            return contacts.outdated(ended or f"the newest frame is {contacts.age_s:.2f} s old")
        return contacts

    def wait(self, timeout: float) -> Contacts:
        """The newest contacts as soon as there are others than this thread got last.

        After ``timeout`` s it returns what there is, with the age that it has, as :meth:`latest`
        does. A change of ``valid`` counts as news too, so a lost board is told at once.
        """
        with self.runner.audience.watch(self._wake), self._news:
            given = getattr(self._mine, "given", None)
            self._news.wait_for(lambda: self.runner.news != given, timeout)
        return self.latest()

    def close(self) -> None:
        """Stop the board and end; returns when it is done. A second call does nothing."""
        self._closed = True
        self.runner.stop()

    def _wake(self) -> None:
        with self._news:
            self._news.notify_all()


def _checked_age(max_age: float) -> float:
    if isinstance(max_age, float | int) and max_age > 0:
        return max_age
    raise SkinError(f"expected a max_age of more than 0 s, got {max_age!r}")


def _each(given: StrPath | Iterable[StrPath]) -> list[StrPath]:
    """The things given, of which one alone is no list."""
    return [given] if isinstance(given, str | os.PathLike) else [*given]


def open_skin(
    skin: Skin | StrPath | None,
    source: str = "twin",
    calibrations: StrPath | Iterable[StrPath] = (),
    *,
    sinks: str | Sequence[str] = (),
    max_age: float = MAX_AGE,
    early: bool = False,
) -> LiveSkin:
    """A skin that runs, from now on.

    Parameters
    ----------
    skin
        Built-in name, path of a skin file, or a skin. None: that of the recording that is played,
        with its calibrations.
    source
        Where frames come from, as for ``--source``: ``serial:PORT``, ``replay:FILE``, ``twin``.
    calibrations
        A file from ``tomoskin calibrate``, or one of each kind. With forces touches are in newtons.
    sinks
        Where results go too, as for ``--sink``: one, or several.
    max_age
        Seconds after which a frame is not valid any more.
    early
        Whether drives tell of touches before their scan ends, where the board can.

    Raises
    ------
    TomoskinError
        When the skin or a calibration cannot be used, or the source cannot be opened.
    """
    _checked_age(max_age)
    prepared = prepared_for(skin, source, calibrations)
    runner = Runner(
        prepared,
        partial(open_source, source, prepared.skin),
        sinks=[make_sink(str(sink)) for sink in _each(sinks)],
        early=early,
    )
    runner.start()
    return LiveSkin(runner, max_age)


def prepared_for(
    skin: Skin | StrPath | None, source: str, calibrations: StrPath | Iterable[StrPath] = ()
) -> Prepared:
    """What a run begins with, as :func:`open_skin` has it. Raises TomoskinError."""
    if skin is not None:
        prepared = prepare(skin if isinstance(skin, Skin) else Skin.load(skin))
    else:
        name, _, argument = source.partition(":")
        if name != "replay":
            raise SkinError(
                f"expected a skin, got none: {source} does not say which it is",
                hint='name one, such as "textile-disc-8"',
            )
        with SessionReader(parse_replay(argument)[0]) as session:
            prepared = as_recorded(session)
    return with_calibrations(prepared, _each(calibrations))
