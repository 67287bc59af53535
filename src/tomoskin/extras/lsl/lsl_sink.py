"""The sink ``lsl``: outlets of the lab streaming layer."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from tomoskin.core import MEASURANDS, Event, FloatArray, SinkError, clock_ahead, encode_json, needed
from tomoskin.files.messages import (
    Contacts,
    Item,
    Naming,
    Stream,
    deformation_state,
    row_labels,
    time_of,
)
from tomoskin.run.sinks import Sink

MOST_TOUCHES = 5
"""Touches that a sample has room for, the strongest first."""

_FIELDS = (("id", ""), ("x", "m"), ("y", "m"), ("peak", "image"))
_WHERE = "sink lsl"
_IRREGULAR = 0.0


class LslSink(Sink):
    """Streams ``NAME-voltages``, ``-dv``, ``-touches``, ``-deformation`` and ``-events``, on LSL's
    own clock."""

    def __init__(self, prefix: str) -> None:
        self.name = f"lsl {prefix}"
        self.naming = Naming(prefix)
        self._lsl = needed("pylsl", "lsl", _WHERE, SinkError)
        self._outlets: dict[str, Any] = {}

    def open(self, stream: Stream) -> None:
        """Announce the streams of one skin."""
        # both are the machine's monotonic clock, but LSL may count from elsewhere
        self._offset = clock_ahead(self._lsl.local_clock)
        rows = [(label, "V") for label in row_labels(stream.pattern)]
        numbers, more = range(1, MOST_TOUCHES + 1), (*MEASURANDS.items(), ("self", ""))
        touches = [(f"{name} {number}", unit) for number in numbers for name, unit in _FIELDS]
        touches += [(f"{name} {number}", unit) for name, unit in more for number in numbers]
        self._announce(stream, "voltages", "EIT", rows)
        self._announce(stream, "dv", "EIT", rows)
        self._announce(stream, "touches", "Touch", [*touches, ("valid", "")])
        bent = [(name, _unit_of(name)) for name in deformation_state(None)]
        self._announce(stream, "deformation", "Deformation", bent)
        self._announce(stream, "events", "Markers", [("event", "")])

    def publish(self, item: Item) -> None:
        """Push the samples of ``item``."""
        for event in (item,) if isinstance(item, Event) else item.events:
            text = encode_json({"kind": event.kind, "text": event.text}).decode()
            self._push("events", [text], item)
        if isinstance(item, Event):
            return
        if item.voltages is not None:
            self._push("voltages", item.voltages, item)
            if item.reference is not None:
                self._push("dv", item.voltages - item.reference, item)
        if item.is_due:
            self._push("touches", touch_sample(item), item)
            sample = np.array([*deformation_state(item.deformation).values()])
            self._push("deformation", sample, item)

    def close(self) -> None:
        """Withdraw the streams that were announced."""
        self._outlets = {}

    def _push(self, name: str, sample: FloatArray | list[str], item: Item) -> None:
        self._outlets[name].push_sample(sample, time_of(item) + self._offset)

    def _announce(
        self, stream: Stream, name: str, kind: str, channels: Sequence[tuple[str, str]]
    ) -> None:
        full = f"{stream.naming.namespace.replace('/', '-')}-{name}"
        # one identity for a stream of a skin: receivers find it again after a restart
        identity = f"{full}-{stream.skin}"
        content = self._lsl.cf_string if kind == "Markers" else self._lsl.cf_double64
        info = self._lsl.StreamInfo(full, kind, len(channels), _IRREGULAR, content, identity)
        described = info.desc().append_child("channels")
        for label, unit in channels:
            channel = described.append_child("channel")
            channel.append_child_value("label", label)
            channel.append_child_value("unit", unit)
        info.desc().append_child_value("skin", stream.skin)
        self._outlets[name] = self._lsl.StreamOutlet(info)


def _unit_of(column: str) -> str:
    """The unit that the name of a column ends with."""
    ending = column.rpartition("_")[2]
    return ending if ending in ("m", "rad") else ""


def open_lsl(argument: str) -> LslSink:
    """``lsl``, or ``lsl:NAME`` for streams called ``NAME-voltages`` and so on."""
    if any(not (c.isalnum() or c in "-_.") for c in argument):
        raise SinkError(f'expected a name of letters and digits, got "{argument}"', where=_WHERE)
    return LslSink(argument or "tomoskin")


def touch_sample(contacts: Contacts) -> FloatArray:
    """Each touch, forces, depths, own touches, then 1 where touches are valid, else 0."""
    row = np.full((MOST_TOUCHES, len(_FIELDS)), np.nan)
    more = np.full((len(MEASURANDS) + 1, MOST_TOUCHES), np.nan)
    strongest = sorted(contacts.touches, key=lambda c: -abs(c.touch.detection.peak))
    for number, contact in enumerate(strongest[:MOST_TOUCHES]):
        touch, detection = contact.touch, contact.touch.detection
        row[number] = touch.id, detection.x, detection.y, detection.peak
        amounts = (touch.amounts.get(name) for name in MEASURANDS)
        values = *(amount and amount.value for amount in amounts), contact.is_self
        more[:, number] = [np.nan if value is None else value for value in values]
    return np.concatenate((row.ravel(), more.ravel(), [float(contacts.valid)]))
