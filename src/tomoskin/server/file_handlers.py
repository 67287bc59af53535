"""Requests about the session folder: what is in it, a session as replay, exports of it."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

from tomoskin.core import DataError, WireError
from tomoskin.formats import WRITERS, Export
from tomoskin.recording import SessionReader
from tomoskin.server.folder import Folder, Listing
from tomoskin.server.hub import Hub
from tomoskin.server.page_messages import text_of
from tomoskin.server.requests import ExportSession, GoLive, ListFiles, OpenSession
from tomoskin.server.source_handlers import SourceSwitch
from tomoskin.server.task import Listener

_EVERY = 0.1
"""Seconds between two images of a picture or film."""

_SESSION = ".mcap"


class FileHandlers:
    """Answers about files of one folder by their names; one export at a time."""

    def __init__(self, hub: Hub, switch: SourceSwitch) -> None:
        self._hub, self._switch = hub, switch
        self._folder = Folder(hub.folder)
        self._exporting: str | None = None
        self._share = 0.0
        hub.serve(
            {
                ListFiles: lambda page, _: self._list(page),
                OpenSession: self._open,
                GoLive: lambda page, _: self._live(page),
                ExportSession: self._export,
            }
        )

    def _list(self, page: Listener) -> None:
        def answer(file: Listing) -> None:
            page.post(
                text_of(
                    type="files",
                    **asdict(file),
                    recording=self._recording(),
                    playing=self._playing(),
                    exporting=self._exporting,
                    share=self._share,
                )
            )

        self._hub.tasks.run(page, self._folder.list_files, answer)

    def _open(self, page: Listener, request: OpenSession) -> None:
        def work() -> None:
            self._switch.play(self._complete(request.name))

        self._hub.tasks.run(page, work, lambda _: self._hub.show())

    def _live(self, page: Listener) -> None:
        self._hub.tasks.run(page, self._switch.back, lambda _: self._hub.show())

    def _export(self, page: Listener, request: ExportSession) -> None:
        if self._exporting is not None:
            raise WireError(f"{self._exporting} is being exported: wait for it")
        self._exporting, self._share = request.name, 0.0

        def work() -> Path:
            try:
                return self._written(self._complete(request.name), request.format)
            finally:
                self._exporting = None

        def done(path: Path) -> None:
            self._hub.tell([text_of(type="exported", name=path.name)])
            self._list(page)

        self._hub.tasks.run(page, work, done)

    def _written(self, path: Path, form: str) -> Path:
        ending = ".csv" if form == "touches" else f".{form}"
        stem = f"{path.stem}-touches" if form == "touches" else path.stem
        write = Export.touches if form == "touches" else WRITERS[ending]
        out = self._folder.free(stem, ending)
        with SessionReader(path) as session:
            write(Export(session, _EVERY, self._advance), out)
        return out

    def _advance(self, done: float, total: float) -> None:
        self._share = done / total if total else 0.0

    def _complete(self, name: str) -> Path:
        if name == self._recording():
            raise DataError("is still being recorded: end the recording first", where=name)
        return self._folder.existing(name, _SESSION)

    def _playing(self) -> str | None:
        replay = self._hub.runner.replay
        return replay.path.name if replay is not None else None

    def _recording(self) -> str | None:
        path = self._hub.runner.status().recording
        return path.name if path is not None else None
