"""Requests about the session folder: what is in it, a session as replay, exports of it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from tomoskin.core import DataError, WireError
from tomoskin.files.exports import WRITERS, Export, export_touches
from tomoskin.files.session import SessionReader
from tomoskin.run import Runner
from tomoskin.server.folder import SESSION, Folder
from tomoskin.server.hub import Hub
from tomoskin.server.page_connection import Page
from tomoskin.server.page_messages import Exported, FileEntry, Files
from tomoskin.server.requests import (
    Annotate,
    DeleteSession,
    ExportSession,
    GoLive,
    ListFiles,
    OpenSession,
    RenameSession,
)
from tomoskin.server.source_handlers import SourceSwitch

_T = TypeVar("_T")

_EVERY = 0.1
"""Seconds between two images of a picture or film."""


class SessionUse:
    """What each session of the folder is in use for."""

    def __init__(self, runner: Runner) -> None:
        self._runner = runner
        self.exporting: str | None = None
        self.share = 0.0

    @property
    def playing(self) -> str | None:
        """Name of the session that is being played."""
        replay = self._runner.flow.marker.replay
        return replay.path.name if replay is not None else None

    @property
    def recording(self) -> str | None:
        """Name of the session that is being recorded."""
        path = self._runner.flow.out.recordings.path
        return path.name if path is not None else None

    def check_ended(self, name: str) -> None:
        """Raise DataError where the session is still being recorded."""
        if name == self.recording:
            raise DataError("is still being recorded: end the recording first", where=name)

    def check_idle(self, name: str) -> None:
        """Raise DataError where the session is in use."""
        self.check_ended(name)
        if name == self.playing:
            raise DataError("is playing: go back to live first", where=name)
        if name == self.exporting:
            raise DataError("is being exported: wait until it has ended", where=name)


class FileHandlers:
    """Answers about files of one folder by their names; one export at a time."""

    def __init__(self, hub: Hub, switch: SourceSwitch) -> None:
        self._hub, self._switch = hub, switch
        self._folder = Folder(hub.folder)
        self._use = SessionUse(hub.runner)
        hub.serve(
            {
                ListFiles: lambda page, _: self._list(page),
                OpenSession: self._open,
                GoLive: lambda page, _: self._live(page),
                ExportSession: self._export,
                RenameSession: self._rename,
                DeleteSession: self._delete,
                Annotate: self._annotate,
            }
        )

    def _list(self, page: Page) -> None:
        def answer(listed: tuple[tuple[FileEntry, ...], int]) -> None:
            files, others = listed
            page.post(Files.of(self._use, files=files, others=others).json)

        self._hub.tasks.run(page, self._folder.list_files, answer)

    def _rename(self, page: Page, request: RenameSession) -> None:
        def work() -> str:
            self._use.check_idle(request.name)
            return self._folder.rename(request.name, request.to)

        self._change(page, work, lambda new: f"{request.name} is now {new}")

    def _delete(self, page: Page, request: DeleteSession) -> None:
        def work() -> None:
            self._use.check_idle(request.name)
            self._folder.delete(request.name)

        self._change(page, work, lambda _: f"{request.name} is deleted")

    def _annotate(self, page: Page, request: Annotate) -> None:
        def work() -> None:
            self._folder.annotate(request.name, request.text)

        self._change(page, work, lambda _: f"Notes on {request.name} are saved")

    def _change(self, page: Page, work: Callable[[], _T], said: Callable[[_T], str]) -> None:
        """Change the folder, and say to every page what has been done."""

        def done(outcome: _T) -> None:
            self._hub.runner.say("folder", said(outcome))
            self._list(page)

        self._hub.tasks.run(page, work, done)

    def _open(self, page: Page, request: OpenSession) -> None:
        def work() -> None:
            self._switch.play(self._complete(request.name))

        self._hub.tasks.run(page, work, lambda _: self._hub.show())

    def _live(self, page: Page) -> None:
        self._hub.tasks.run(page, self._switch.back, lambda _: self._hub.show())

    def _export(self, page: Page, request: ExportSession) -> None:
        if self._use.exporting is not None:
            raise WireError(f"{self._use.exporting} is being exported: wait until it has ended")
        self._use.exporting, self._use.share = request.name, 0.0

        def work() -> Path:
            try:
                return self._written(self._complete(request.name), request.format)
            finally:
                self._use.exporting = None

        def done(path: Path) -> None:
            self._hub.tell(Exported(name=path.name))
            self._list(page)

        self._hub.tasks.run(page, work, done)

    def _written(self, path: Path, form: str) -> Path:
        ending = ".csv" if form == "touches" else f".{form}"
        stem = f"{path.stem}-touches" if form == "touches" else path.stem
        write = export_touches if form == "touches" else WRITERS[ending]
        out = self._folder.free(stem, ending)
        with SessionReader(path) as session:
            write(Export(session, _EVERY, self._advance), out)
        return out

    def _advance(self, done: float, total: float) -> None:
        self._use.share = done / total if total else 0.0

    def _complete(self, name: str) -> Path:
        self._use.check_ended(name)
        return self._folder.existing(name, SESSION)
