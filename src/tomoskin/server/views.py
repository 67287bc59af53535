"""A run as a page is told of it: its scene, its state, its recording."""

from __future__ import annotations

from typing import Any

import numpy as np

from tomoskin import __version__
from tomoskin.core import Event, FloatArray, IntArray
from tomoskin.files.session import Timeline
from tomoskin.model.mesh import Plane
from tomoskin.model.skin import Ambiguity
from tomoskin.pipeline import Prepared
from tomoskin.run import MAX_FORCE, Status
from tomoskin.server import page_messages as to_page

PROBE = to_page.ProbeSizes(radius_m=0.015, force_n=3.0, max_force_n=MAX_FORCE)
"""A press from the page unless it says otherwise: the source's usual probe."""

_OUTLINE_POINTS = 240

_SLOWEST = 10
"""Of the slowest frames, those that a page is told."""


def scene(
    prepared: Prepared, source: str, *, limit: float, pressable: bool, truth: bool = False
) -> to_page.Scene:
    """What ``limit`` ends the colour scale of, in the image's unit.

    ``truth``: a replay knows what pressed.
    """
    skin, mesh, pattern = prepared.skin, prepared.mesh, prepared.pattern
    return to_page.Scene(
        skin=to_page.SkinName.of(skin, source=str(skin.source)),
        unit=prepared.operator.unit,
        limit=limit,
        points=flat(mesh.points),
        solid=None if isinstance(skin.surface, Plane) else flat(skin.surface.point(mesh.points)),
        cells=flat(mesh.cells),
        outline=flat(skin.outline.polyline(skin.outline.length / _OUTLINE_POINTS)),
        electrodes=[
            to_page.Electrode(x=x, y=y, label=f"E{number}", points=arc(facets))
            for number, ((x, y), facets) in enumerate(
                zip(skin.electrode_centres.tolist(), mesh.electrodes, strict=True), 1
            )
        ],
        pattern=to_page.PatternRows.of(
            pattern,
            name=pattern.identity,
            drive=flat(pattern.drive),
            measure=flat(pattern.measure),
        ),
        source=source,
        pressable=pressable,
        truth=pressable or truth,
        probe=PROBE,
        version=__version__,
        same=_same_places(prepared.ambiguity),
    )


def _same_places(ambiguity: Ambiguity | None) -> to_page.SamePlaces | None:
    if ambiguity is None:
        return None
    maps = [flat(np.append(one.matrix, one.shift)) for one in ambiguity.symmetries]
    return to_page.SamePlaces(text=ambiguity.text, maps=maps, least_m=ambiguity.least)


def state(status: Status) -> to_page.RunState:
    """The state of the run as the page gets it."""
    reference, baseline = status.reference, status.reference.baseline
    return to_page.RunState.of(
        status,
        p50_ms=1e3 * status.p50,
        p99_ms=1e3 * status.p99,
        stages=[
            to_page.StageNow(name=stage.name, p50_ms=1e3 * stage.p50, p99_ms=1e3 * stage.p99)
            for stage in status.stages
        ],
        slowest=[
            to_page.SlowFrame.of(cost, host_time_s=cost.host_time)
            for cost in status.slowest[:_SLOWEST]
        ],
        reference=to_page.ReferenceNow.of(reference, age_s=status.reference_age),
        baseline=baseline
        and to_page.BaselineNow.of(baseline, held_s=baseline.held, noise_v=baseline.noise),
        sick=status.electrodes,
        noise_v=reference.noise,
        alpha=status.choice.alpha,
        rule=status.choice.rule,
        recording=None if status.recording is None else status.recording.name,
        calibration=status.calibration and to_page.CalibrationNow.of(status.calibration),
    )


def event(happened: Event) -> to_page.EventNote:
    """An event of the run as the page gets it."""
    return to_page.EventNote.of(happened, time_s=happened.host_time)


def timeline(line: Timeline) -> to_page.PlayedTimeline:
    """What happened in a recording."""
    return to_page.PlayedTimeline(
        end_s=line.end,
        notes=[to_page.EventNote.of(note, time_s=time) for time, note in line.notes],
        events=[to_page.EventNote.of(one, time_s=time) for time, one in line.events],
        touches=line.touches,
    )


def arc(facets: IntArray) -> list[int]:
    """Points along an electrode, whose edges the mesher lays one after the other."""
    return [*facets[:, 0].tolist(), int(facets[-1, 1])]


def flat(table: FloatArray | IntArray) -> list[Any]:
    """All numbers of a table, measurement by measurement."""
    return list(np.asarray(table).reshape(-1).tolist())
