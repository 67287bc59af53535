"""The text messages to a page: scene, state, event and error. Requests: ``server/requests.py``,
frames: ``server/frames.py``."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import Any

import numpy as np

from tomoskin import __version__
from tomoskin.core import Event, FloatArray, IntArray, encode_json
from tomoskin.files.session import Timeline
from tomoskin.learning import BendReading, CalibrationHealth, ClassReading
from tomoskin.model.mesh import Plane
from tomoskin.pipeline import Prepared, Unresolved
from tomoskin.run import MAX_FORCE, Status
from tomoskin.sensing.signal import BaselineState, ElectrodeHealth

PROBE_RADIUS = 0.015
"""Radius of a press from the page unless it says otherwise, m: the source's usual probe."""

PROBE_FORCE = 3.0
"""Its force, N."""


_OUTLINE_POINTS = 240

_SLOWEST = 10
"""Of the slowest frames, those that a page is told."""


def scene(prepared: Prepared, source: str, *, limit: float, pressable: bool) -> str:
    """Everything about the skin that does not change from frame to frame.

    ``limit`` is the end of the fixed symmetric colour scale, in the image's unit; lengths are m,
    coordinates lie flat as x0, y0, x1, y1, …; electrodes and points are counted from 0, labels
    from E1. ``solid``: where the points lie in space, x0, y0, z0, …, of a sheet on a surface.
    """
    skin, mesh, pattern = prepared.skin, prepared.mesh, prepared.pattern
    return text_of(
        type="scene",
        skin={"name": skin.name, "description": skin.description, "source": str(skin.source)},
        unit=prepared.operator.unit,
        limit=limit,
        points=flat(mesh.points),
        solid=None if isinstance(skin.surface, Plane) else flat(skin.surface.point(mesh.points)),
        cells=flat(mesh.cells),
        outline=flat(skin.outline.polyline(skin.outline.length / _OUTLINE_POINTS)),
        electrodes=_electrodes(prepared),
        pattern={
            "name": pattern.identity,
            "n_meas": pattern.n_meas,
            "n_drive": pattern.n_drive,
            "drive": flat(pattern.drive),
            "measure": flat(pattern.measure),
        },
        source=source,
        pressable=pressable,
        probe={"radius_m": PROBE_RADIUS, "force_n": PROBE_FORCE, "max_force_n": MAX_FORCE},
        version=__version__,
    )


def scale(prepared: Prepared, limit: float) -> str:
    """The end of the colour scale, and its unit, where nothing else of the scene is new."""
    return text_of(type="scale", limit=limit, unit=prepared.operator.unit)


def state(status: Status) -> str:
    """One look at the runner; numbers that are not known yet are null."""
    reference = status.reference
    return text_of(
        type="state",
        running=status.running,
        paused=status.paused,
        fps=status.fps,
        frames=status.frames,
        dropped=status.dropped,
        corrupt=status.corrupt,
        gaps=status.gaps,
        p50_ms=finite(1e3 * status.p50),
        p99_ms=finite(1e3 * status.p99),
        stages=stages(status),
        slowest=slowest(status),
        reference={
            "frames": reference.frames,
            "needed": reference.needed,
            "age_s": status.reference_age,
            "ready": reference.ready,
        },
        baseline=_baseline(reference.baseline),
        sick=[_sick(electrode) for electrode in status.electrodes],
        noise_v=finite(reference.noise),
        alpha=status.choice.alpha,
        rule=status.choice.rule,
        left_out=status.left_out,
        recording=status.recording and status.recording.name,
        sinks=status.sinks,
        replay=status.replay,
        **readings(status),
        problem=status.problem,
        text=status.text,
    )


def stages(status: Status) -> list[dict[str, Any]]:
    """Where the age of a picture comes from, stage by stage."""
    return [
        {
            "name": stage.name,
            "p50_ms": finite(1e3 * stage.p50),
            "p99_ms": finite(1e3 * stage.p99),
        }
        for stage in status.stages
    ]


def slowest(status: Status) -> list[dict[str, Any]]:
    """What the slowest frames took their time for."""
    return [
        {"sequence": cost.sequence, "host_time_s": cost.host_time, "text": cost.text}
        for cost in status.slowest[:_SLOWEST]
    ]


def readings(status: Status) -> dict[str, Any]:
    """What calibrations say of the newest frame, or of themselves; null where there are none."""
    return {
        "bend": _bend(status.bend),
        "class": _class(status.class_reading),
        "calibration": _calibration(status.calibration),
    }


def _baseline(now: BaselineState | None) -> dict[str, Any] | None:
    """Drift since the reference as a part of it, how long it is held, and whether it is stale."""
    if now is None:
        return None
    return {
        "drift": finite(now.drift),
        "held_s": now.held,
        "noise_v": finite(now.noise),
        "stale": now.stale,
    }


def _bend(now: BendReading | None) -> dict[str, Any] | None:
    """Angles in rad, as ``tomoskin image --json`` tells them."""
    if now is None:
        return None
    return {"angle_rad": now.angle, "sd_rad": now.sd, "axis_rad": now.axis, "state": now.state}


def _class(now: ClassReading | None) -> dict[str, Any] | None:
    """Which state the newest frame shows, as ``tomoskin image --json`` tells it."""
    return None if now is None else asdict(now)


def _calibration(now: CalibrationHealth | None) -> dict[str, Any] | None:
    """How touches fit the calibration that locates them, in words for people."""
    if now is None:
        return None
    return {
        "well": now.well,
        "broken": now.broken,
        "findings": list(now.findings),
    }


def _sentence(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}."


def _sick(electrode: ElectrodeHealth) -> dict[str, Any]:
    return {
        "electrode": electrode.electrode,
        "state": electrode.state,
        "reason": electrode.reason,
        "since_s": electrode.since,
    }


def event(happened: Event) -> str:
    """Something that a person should know."""
    return text_of(type="event", time_s=happened.host_time, kind=happened.kind, text=happened.text)


def unresolved(found: Unresolved | None, problem: str = "") -> str:
    """What the data cannot tell: part of a change that they leave open, per cell; or why not."""
    values, radius = (None, 0.0) if found is None else (found.values.round(3), found.radius)
    return text_of(
        type="unresolved",
        values=None if values is None else flat(values),
        radius_m=radius,
        problem=problem,
    )


def timeline(line: Timeline) -> str:
    """What happened in the recording that is played; times in s from its first frame."""
    return text_of(
        type="timeline",
        end_s=line.end,
        notes=[{"time_s": time, "text": event.text} for time, event in line.notes],
        events=[
            {"time_s": time, "kind": event.kind, "text": event.text} for time, event in line.events
        ],
        touches=[
            {"id": span.id, "kind": span.kind, "begin_s": span.begin, "end_s": span.end}
            for span in line.touches
        ],
    )


def error(message: str) -> str:
    """Answer to a request that was not understood."""
    return text_of(type="error", message=message)


def _electrodes(prepared: Prepared) -> list[dict[str, Any]]:
    centres = prepared.skin.electrode_centres.tolist()
    return [
        {"x": x, "y": y, "label": f"E{number}", "points": chain(facets)}
        for number, ((x, y), facets) in enumerate(
            zip(centres, prepared.mesh.electrodes, strict=True), 1
        )
    ]


def chain(facets: IntArray) -> list[int]:
    """Points along an open chain of edges, from one end to the other.

    ``facets`` is (n, 2); where the edges do not form a single open chain, their points in
    ascending order.
    """
    beside: dict[int, list[int]] = {}
    for a, b in facets.tolist():
        beside.setdefault(a, []).append(b)
        beside.setdefault(b, []).append(a)
    ends = [point for point, others in beside.items() if len(others) == 1]
    if len(ends) != 2 or max(map(len, beside.values())) > 2:
        return sorted(beside)
    walk, before = [ends[0]], -1
    while len(onward := [p for p in beside[walk[-1]] if p != before]) == 1:
        before = walk[-1]
        walk.append(onward[0])
    return walk


def finite(value: float | None) -> float | None:
    """The value; None for what JSON has no number for."""
    return None if value is None or not math.isfinite(value) else value


def flat(table: FloatArray | IntArray) -> list[float]:
    """All numbers of a table, row by row."""
    flat: list[float] = np.asarray(table).reshape(-1).tolist()
    return flat


def text_of(**fields: Any) -> str:
    """A message to a page."""
    return encode_json(fields).decode()
