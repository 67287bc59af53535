"""The sink ``rerun``: the sheet in space, touches and series, for Rerun's viewer or a file."""

from __future__ import annotations

from typing import Any

from tomoskin.core import Output, SinkError, check_outputs, needed
from tomoskin.extras.rerun.rerun_view import RerunView, rerun_recording
from tomoskin.files.messages import Item, Naming, Stream
from tomoskin.run.sinks import Sink, options_of, port_of

_WHERE = "sink rerun"
_ADDRESS, _PORT = "127.0.0.1", 9876
_PATIENCE = 5.0
"""Seconds in which a viewer must take what was sent."""


class RerunSink(Sink):
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
        self.naming, self._target = naming, target
        self._rerun = needed("rerun", "rerun", _WHERE, SinkError)
        self._recording: Any = None

    def open(self, stream: Stream) -> None:
        """Begin a recording; OutputError when its file is there already."""
        recording = rerun_recording(self._rerun, stream)
        if self._target.endswith(".rrd"):
            path = stream.file(self._target)
            check_outputs([Output(path)], overwrite=False)
            recording.save(path)
        else:
            recording.connect_grpc(f"rerun+http://{self._target}/proxy")
        self._recording = recording
        self._view = RerunView(self._rerun, recording, stream)

    def publish(self, item: Item) -> None:
        """Log one frame or event at its time."""
        self._view.log(item)

    def close(self) -> None:
        """End the recording once the viewer has it."""
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
