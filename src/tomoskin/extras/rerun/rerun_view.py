"""What a sink or a session says to Rerun: the sheet in space, touches and series."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any
from uuid import uuid4

import numpy as np

from tomoskin.core import CHANGE, MEASURANDS, Event, Image, SinkError, StrPath, needed, written
from tomoskin.files import messages
from tomoskin.files.exports import Export, ExportFormat

_WHERE = "rerun"
_ARROW = 0.02
"""Length of a touch's normal, m."""

_ROBOT = uuid4()
"""Identity of what the skins of one robot log."""


class RerunView:
    """Logs results and events to a recording stream of Rerun, on the timeline ``time``."""

    def __init__(self, rerun: Any, recording: Any, stream: messages.Stream) -> None:
        self._rerun, self._recording, self._stream = rerun, recording, stream
        self._ids: set[int] = set()
        self._bent: frozenset[str] = frozenset()
        if stream.corners is not None:
            corners = stream.corners.reshape(-1, 3)
            sheet = rerun.Mesh3D(
                vertex_positions=corners, triangle_indices=np.arange(len(corners)).reshape(-1, 3)
            )
            recording.log(self._path("sheet"), sheet, static=True)

    def log(self, item: messages.Item) -> None:
        """What ``item`` says, at the time of its measurement."""
        utc = self._stream.utc(messages.time_of(item))
        when = {"duration": messages.time_of(item)} if utc is None else {"timestamp": utc}
        self._recording.set_time("time", **when)
        for event in (item,) if isinstance(item, Event) else item.events:
            text = self._rerun.TextLog(f"{event.kind}: {event.text}")
            self._recording.log(self._path("events"), text)
        if isinstance(item, Event):
            return
        if item.is_due:
            self._touches(item)
        if item.image is not None and self._stream.corners is not None:
            self._sheet(item.image)

    def _touches(self, contacts: messages.Contacts) -> None:
        touches = contacts.tracked
        places = np.array([contact.position for contact in contacts.touches]).reshape(-1, 3)
        normals = np.array([contact.normal for contact in contacts.touches]).reshape(-1, 3)
        colours = [[*messages.touch_colour(touch).values()] for touch in touches]
        dots = self._rerun.Points3D(
            places,
            radii=[messages.touch_width(touch) / 2 for touch in touches],
            labels=[str(touch.id) for touch in touches],
            colors=np.array(colours).reshape(-1, 4),
        )
        self._recording.log(self._path("touches"), dots)
        arrows = self._rerun.Arrows3D(origins=places, vectors=_ARROW * normals)
        self._recording.log(self._path("normals"), arrows)
        self._series("valid", float(contacts.valid))
        if contacts.latency is not None:
            self._series("latency", contacts.latency)
        for contact in contacts.touches:
            touch = contact.touch
            self._series(f"peak/{touch.id}", touch.detection.peak)
            for name, amount in touch.amounts.items():
                self._series(f"{name}/{touch.id}", amount.value)
        self._deformation(contacts)
        ids = {touch.id for touch in touches}
        for gone in self._ids - ids:  # or its line would go on for ever
            for name in ("peak", *MEASURANDS):
                gap = self._rerun.Clear(recursive=False)
                self._recording.log(self._path(f"{name}/{gone}"), gap)
        self._ids = ids

    def _deformation(self, contacts: messages.Contacts) -> None:
        """Its numbers as series; those that are not told any more end."""
        state = messages.deformation_state(contacts.deformation)
        known = {name: value for name, value in state.items() if not math.isnan(value)}
        for name in self._bent - known.keys():
            gap = self._rerun.Clear(recursive=False)
            self._recording.log(self._path(f"deformation/{name}"), gap)
        if known["kind"] or self._bent:
            for name, value in known.items():
                self._series(f"deformation/{name}", value)
        self._bent = frozenset(known) if known["kind"] else frozenset()

    def _sheet(self, image: Image) -> None:
        share = np.clip(image.values / self._stream.limit, -1.0, 1.0)
        last = len(CHANGE.table) - 1
        colours = CHANGE.table[np.rint((share + 1) / 2 * last).astype(int)]
        mesh = self._rerun.Mesh3D.from_fields(vertex_colors=np.repeat(colours, 3, axis=0))
        self._recording.log(self._path("sheet"), mesh)

    def _series(self, name: str, value: float) -> None:
        self._recording.log(self._path(name), self._rerun.Scalars(value))

    def _path(self, name: str) -> str:
        return f"{self._stream.naming.namespace}/{name}"


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
    rerun, stream = needed("rerun", "rerun", _WHERE, SinkError), job.stream
    with written(path, overwrite=job.overwrite) as part:
        recording = rerun_recording(rerun, stream)
        recording.save(str(part))
        view = RerunView(rerun, recording, stream)
        for item in job.items():
            view.log(item)
        recording.flush()
        recording.disconnect()


def rerun_recording(rerun: Any, stream: messages.Stream) -> Any:
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


FORMAT = ExportFormat(write_rerun, "a recording of Rerun", ("rerun", "rerun"), of_links=True)
"""What is registered for ``.rrd``."""
