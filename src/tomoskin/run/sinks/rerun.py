"""The sink ``rerun``: the sheet in space, touches and series, for Rerun's viewer or a file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any
from uuid import uuid4

import numpy as np

from tomoskin.core import CHANGE, Event, Image, Output, SinkError, StrPath, check_outputs, written
from tomoskin.files.session import as_recorded, touch_colour, touch_width
from tomoskin.run.sinks.consumer import needed, options_of, port_of
from tomoskin.run.sinks.contact import Contacts
from tomoskin.run.sinks.naming import Naming
from tomoskin.run.sinks.recorded import recorded_items, recorded_stream
from tomoskin.run.sinks.sink import Item, Moment, Stream, TouchPace

if TYPE_CHECKING:
    from tomoskin.files.exports import Export

_WHERE = "sink rerun"
_ADDRESS, _PORT = "127.0.0.1", 9876
_ARROW = 0.02
"""Length of a touch's normal, m."""

_ROBOT = uuid4()
"""Identity of what the skins of one robot log."""

_PATIENCE = 5.0
"""Seconds in which a viewer must take what was sent."""


class RerunView:
    """Logs results and events to a recording stream of Rerun, on the timeline ``time``."""

    def __init__(self, rerun: Any, recording: Any, stream: Stream, naming: Naming) -> None:
        self._rerun, self._recording = rerun, recording
        self._stream, self._naming = stream, naming
        self._pace = TouchPace()
        self._ids: set[int] = set()
        if stream.corners is not None:
            corners = stream.corners.reshape(-1, 3)
            sheet = rerun.Mesh3D(
                vertex_positions=corners, triangle_indices=np.arange(len(corners)).reshape(-1, 3)
            )
            recording.log(self._path("sheet"), sheet, static=True)

    def log(self, item: Item) -> None:
        """What ``item`` says, at the time of its measurement."""
        utc = self._stream.utc(item.host_time)
        when = {"duration": item.host_time} if utc is None else {"timestamp": utc}
        self._recording.set_time("time", **when)
        for event in (item,) if isinstance(item, Event) else item.messages:
            text = self._rerun.TextLog(f"{event.kind}: {event.text}")
            self._recording.log(self._path("events"), text)
        if isinstance(item, Event):
            return
        if self._pace.is_due(item):
            self._touches(item)
        if item.image is not None and self._stream.corners is not None:
            self._sheet(item.image)

    def _touches(self, moment: Moment) -> None:
        contacts = Contacts.of(self._stream, self._naming, moment)
        found = [contact.touch for contact in contacts.touches]
        places = np.array([contact.position for contact in contacts.touches]).reshape(-1, 3)
        normals = np.array([contact.normal for contact in contacts.touches]).reshape(-1, 3)
        colours = [[*touch_colour(touch).values()] for touch in found]
        dots = self._rerun.Points3D(
            places,
            radii=[touch_width(touch) / 2 for touch in found],
            labels=[str(touch.id) for touch in found],
            colors=np.array(colours).reshape(-1, 4),
        )
        self._recording.log(self._path("touches"), dots)
        arrows = self._rerun.Arrows3D(origins=places, vectors=_ARROW * normals)
        self._recording.log(self._path("normals"), arrows)
        self._series("valid", float(contacts.valid))
        if contacts.latency is not None:
            self._series("latency", contacts.latency)
        for touch in found:
            self._series(f"peak/{touch.id}", touch.detection.peak)
            if touch.detection.force is not None:
                self._series(f"force/{touch.id}", touch.detection.force.newtons)
        ids = {touch.id for touch in found}
        for gone in self._ids - ids:  # or its line would go on for ever
            for name in ("peak", "force"):
                gap = self._rerun.Clear(recursive=False)
                self._recording.log(self._path(f"{name}/{gone}"), gap)
        self._ids = ids

    def _sheet(self, image: Image) -> None:
        share = np.clip(image.values / self._stream.limit, -1.0, 1.0)
        last = len(CHANGE.table) - 1
        colours = CHANGE.table[np.rint((share + 1) / 2 * last).astype(int)]
        mesh = self._rerun.Mesh3D.from_fields(vertex_colors=np.repeat(colours, 3, axis=0))
        self._recording.log(self._path("sheet"), mesh)

    def _series(self, name: str, value: float) -> None:
        self._recording.log(self._path(name), self._rerun.Scalars(value))

    def _path(self, name: str) -> str:
        return f"{self._naming.namespace}/{name}"


class RerunSink:
    """Sends results to a viewer that listens, or into a new file.

    Parameters
    ----------
    target
        A file that ends in .rrd, or ``HOST:PORT`` of a viewer.
    naming
        Before what its entities begin with.
    """

    def __init__(self, target: str, naming: Naming) -> None:
        self.name = f"rerun {target}"
        self._target, self._naming = target, naming
        self._rerun = needed("rerun", "rerun")
        self._recording: Any = None

    def open(self, stream: Stream) -> None:
        """Begin a recording; OutputError when its file is there already."""
        recording = _recording(self._rerun, stream)
        if self._target.endswith(".rrd"):
            path = _file_of(Path(self._target), stream)
            check_outputs([Output(path)], overwrite=False)
            recording.save(path)
        else:
            recording.connect_grpc(f"rerun+http://{self._target}/proxy")
        self._recording = recording
        self._view = RerunView(self._rerun, recording, stream, self._naming.of_skin(stream))

    def publish(self, item: Item) -> None:
        """Log ``item``."""
        self._view.log(item)

    def close(self) -> None:
        """End the recording."""
        recording, self._recording = self._recording, None
        if recording is None:
            return
        try:
            recording.flush(timeout_sec=_PATIENCE)
        except RuntimeError as error:
            raise SinkError(
                f"no viewer accepted the connection: {error}", where=self.name
            ) from error
        finally:
            recording.disconnect()


def open_rerun(argument: str) -> RerunSink:
    """``rerun``, ``rerun:HOST:PORT``, ``rerun:FILE.rrd``, each with ``,namespace=NAME``."""
    target, *words = argument.split(",")
    naming = Naming.of(options_of(words, ("namespace",), _WHERE), _WHERE)
    if not target.endswith(".rrd"):
        host, _, port = target.rpartition(":")
        number = port_of(port, _WHERE) if port else _PORT
        target = f"{host or _ADDRESS}:{number}"
    return RerunSink(target, naming)


def write_rerun(job: Export, path: StrPath) -> None:
    """Write what the sink would have sent of a session; an image every ``job.every`` s.

    Raises
    ------
    DataError, OutputError
        When the session cannot be replayed, or the file not be written.
    SinkError
        When Rerun is not installed.
    """
    path = Path(path)
    rerun, prepared = needed("rerun", "rerun"), as_recorded(job.session)
    stream = recorded_stream(job, prepared)
    with written(path, overwrite=job.overwrite) as part:
        recording = _recording(rerun, stream)
        recording.save(str(part))
        view = RerunView(rerun, recording, stream, Naming())
        for item in recorded_items(job, prepared):
            view.log(item)
        recording.flush()
        recording.disconnect()


def _file_of(path: Path, stream: Stream) -> Path:
    """The file of one skin: on a robot its name stands in that of the file."""
    place = stream.place
    return path if place is None else path.with_stem(f"{path.stem}-{place.name}")


def _recording(rerun: Any, stream: Stream) -> Any:
    """A recording whose only times are those of the measurements.

    Those of a robot's skins have one identity in a process: a viewer shows them as one.
    """
    if stream.corners is None and stream.points is not None:
        raise SinkError("Rerun shows sheets, but this skin is a body", where=_WHERE)
    if stream.place is None:
        recording = rerun.RecordingStream(f"tomoskin {stream.skin}")
    else:
        recording = rerun.RecordingStream("tomoskin robot", recording_id=_ROBOT)
    recording.set_log_time_enabled(False)
    recording.set_log_tick_enabled(False)
    return recording
