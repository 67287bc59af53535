"""Services of the sink ``ros2``: nodes of ROS 2 ask for a new reference, and for recordings."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping
from typing import Any
from uuid import uuid4

from tomoskin.core import TomoskinError

Action = Callable[[], str]
"""Does what is asked, and says what that was; raises TomoskinError."""

_OFTEN = 0.05
"""Seconds between two looks for requests."""

_PATIENCE = 1.0
"""Seconds in which the reader of whoever asks must have been discovered."""

_AT_ONCE = 10


class TriggerServices:
    """Answers requests of ``std_srvs/srv/Trigger`` from a thread of its own until it is closed.

    DDS has topics only: a service is one for requests and one for replies. By ``rmw_cyclonedds``
    both begin with who asks and the number of the request, and a reply repeats them. Other
    middlewares of ROS 2 keep them elsewhere, and cannot be answered.

    Parameters
    ----------
    dds
        Modules of CycloneDDS by name.
    participant
        Whose services they are.
    actions
        What to do, by the full name of the service, without its first "/".
    """

    def __init__(
        self, dds: Mapping[str, Any], participant: Any, actions: Mapping[str, Action]
    ) -> None:
        types = dds["idl"].types
        head = {"guid": types.uint64, "seq": types.int64}
        request = _struct(
            dds, "Request", head | {"structure_needs_at_least_one_member": types.uint8}
        )
        self._reply = _struct(dds, "Response", head | {"success": bool, "message": str})
        self._ends = []
        for name, action in actions.items():
            policy, topic = dds["core"].Policy, dds["topic"].Topic
            qos = dds["core"].Qos(
                policy.Reliability.Reliable(1_000_000_000),
                policy.History.KeepLast(_AT_ONCE),
                policy.DataRepresentation(use_cdrv0_representation=True),
                policy.Userdata(f"serviceid={uuid4().hex};".encode()),
            )
            asked = topic(participant, f"rq/{name}Request", request)
            replied = topic(participant, f"rr/{name}Reply", self._reply)
            reader = dds["sub"].DataReader(participant, asked, qos=qos)
            writer = dds["pub"].DataWriter(participant, replied, qos=qos)
            self._ends.append((reader, writer, action))
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._serve, name="tomoskin-services", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Answer no more; returns when the last answer has been given."""
        self._ended.set()
        self._thread.join()
        self._ends = []

    def _serve(self) -> None:
        while not self._ended.wait(_OFTEN):
            for reader, writer, action in self._ends:
                for request in reader.take(N=_AT_ONCE):
                    if request.sample_info.valid_data:
                        self._answer(request, writer, action)

    def _answer(self, request: Any, writer: Any, action: Action) -> None:
        try:
            done, message = True, action()
        except TomoskinError as error:
            done, message = False, str(error)
        deadline = time.monotonic() + _PATIENCE
        while not writer.get_matched_subscriptions() and time.monotonic() < deadline:
            self._ended.wait(_OFTEN)
        writer.write(self._reply(request.guid, request.seq, done, message))


def _struct(dds: Mapping[str, Any], part: str, fields: Mapping[str, Any]) -> Any:
    name = f"Trigger_{part}_"
    return dds["idl"].make_idl_struct(name, f"std_srvs.srv.dds_.{name}", dict(fields))
