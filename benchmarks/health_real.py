"""Electrode health and drift on public recordings: what was untouched, and what was pressed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from report import Report
from tomoskin.core import FloatArray
from tomoskin.model.pattern import Pattern
from tomoskin.sensing.signal import Baseline, Monitor, NuisanceSubspace, Reference

IDLE = 20
"""First frames of a recording that make its reference."""

SERIES = (
    ("eskin_membrane8_environment/env", "rms"),
    ("eskin_hydrogel_rect8/rect8_single10k", "v_up"),
    ("eskin_hydrogel_round/round16_single550", "v_up"),
    ("eskin_hydrogel_round/round16_single500_ohmc", "v_up"),
    ("eskin_hydrogel_round/round8_single500_ohmc", "v_up"),
    ("eskin_hydrogel_round/round16_damage_series", "v"),
    ("eskin_gelatin_rect32/baseline_SD", "v"),
    ("eskin_gelatin_rect32/baseline_ND", "v"),
    ("eskin_gelatin_rect32/baseline_SN", "v"),
)
PRESSED = (
    ("eskin_hydrogel_rect8/rect8_single10k", "v_down"),
    ("eskin_hydrogel_round/round16_single550", "v_down"),
    ("eskin_hydrogel_round/round16_single500_ohmc", "v_down"),
    ("eskin_hydrogel_round/round8_single500_ohmc", "v_down"),
    ("eidors_tanks16/ottawa2005_moving_ball_series", "v"),
    ("eidors_tanks16/montreal1995_rod_circle", "v"),
)


def real_reports(data: Path | None) -> tuple[Report, ...]:
    """Both tables, or none where the recordings are not there."""
    folder = data or Path(__file__).resolve().parents[2] / "shared" / "data"
    if not folder.is_dir():
        return ()
    return drift(folder), alarms(folder)


def drift(folder: Path) -> Report:
    """How far an untouched frame is from the reference, first and followed."""
    rows = [(name.split("/")[1], *_drifted(*_read(folder, name, key))) for name, key in SERIES]
    return Report(
        "drift of untouched skins",
        (
            "recording",
            "frames",
            "change %",
            "first reference",
            "its common modes out",
            "followed",
            "followed, modes out",
            "modes",
        ),
        tuple(rows),
        (
            "rms over rows and frames of the difference from the reference, in deviations of one "
            "frame (from successive differences); median over frames; the first 20 make the "
            "reference, each later frame is predicted from those before it",
            "change: of the mean of the last twentieth against the first; modes: the gain and "
            "the directions learnt until then, taken out by plain projection",
            "one frame a second is assumed; the robot lifted its probe before each of these frames",
        ),
    )


def _read(folder: Path, name: str, key: str) -> tuple[Pattern, FloatArray]:
    """Pattern and (n_frames, n_rows) of the rows that live."""
    with np.load(folder / f"{name}.npz") as file:
        values = np.asarray(file[key]).real.astype(float)
        drive, measure = file["inj"], file["meas"]
        valid = file["valid"] if "valid" in file.files else np.ones(len(drive), bool)
    if values.shape[1] != len(drive):
        drive, measure = drive[: values.shape[1]], measure[: values.shape[1]]
    good = valid[: values.shape[1]] & np.isfinite(values).all(axis=0) & (np.ptp(values, axis=0) > 0)
    good &= _apart(drive, measure)
    return _pattern(drive, measure, good), values[:, _kept(drive, measure, good)]


def _apart(drive: NDArray[Any], measure: NDArray[Any]) -> NDArray[np.bool_]:
    rows = np.hstack([drive, measure])
    return np.array([len(set(row)) == 4 for row in rows.tolist()])


def _kept(drive: NDArray[Any], measure: NDArray[Any], good: NDArray[np.bool_]) -> NDArray[Any]:
    """Rows that are good, each once: a reversed row is the same."""
    ends = np.hstack([np.sort(drive, axis=1), np.sort(measure, axis=1)])[good]
    _, first = np.unique(ends, axis=0, return_index=True)
    return np.flatnonzero(good)[np.sort(first)]


def _pattern(drive: NDArray[Any], measure: NDArray[Any], good: NDArray[np.bool_]) -> Pattern:
    kept = _kept(drive, measure, good)
    return Pattern.from_tables(drive[kept].astype(int), measure[kept].astype(int))


def _drifted(pattern: Pattern, values: FloatArray) -> tuple[object, ...]:
    reference = Reference.of(values[:IDLE])
    baseline = Baseline(reference)
    none = np.zeros(pattern.n_meas, bool)
    noise = np.sqrt(np.mean(np.diff(values, axis=0) ** 2, axis=0) / 2)
    noise = np.maximum(noise, 0.5 * np.median(noise))
    found, modes, gain = [], np.zeros((pattern.n_meas, 0)), reference.mean[:, None]
    blind = _plain(gain, noise)
    for number, frame in enumerate(values[IDLE:]):
        first, last = (frame - reference.mean) / noise, (frame - baseline.mean) / noise
        found.append([_rms(x) for x in (first, blind(first), last, blind(last))])
        if baseline.push(frame, none, float(number), touched=False):
            modes = baseline.idle.modes(lambda: np.zeros((pattern.n_meas, 1)))
            blind = _plain(np.hstack([gain, modes]), noise)
    part = max(len(values) // 20, 1)
    start, end = values[:part].mean(axis=0), values[-part:].mean(axis=0)
    change = 100 * np.linalg.norm(end - start) / np.linalg.norm(start)
    medians = [round(float(m), 2) for m in np.median(found, axis=0)]
    return len(values), round(float(change), 1), *medians, 1 + modes.shape[1]


def _plain(directions: FloatArray, noise: FloatArray) -> NuisanceSubspace:
    return NuisanceSubspace.of(directions / noise[:, None], np.eye(len(noise)))


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def alarms(folder: Path) -> Report:
    """Electrodes that health blames in recordings of skins that were well."""
    rows = []
    for name, key in dict.fromkeys(SERIES + PRESSED):
        pattern, values = _read(folder, name, key)
        idle = values if key != "v_down" else _read(folder, name, "v_up")[1]
        reference = Reference.of(idle[:IDLE])
        monitor = Monitor(
            pattern, reference, reference.mean, unusable=np.zeros(pattern.n_meas, bool)
        )
        none = np.zeros(pattern.n_meas, bool)
        health = [monitor.push(v, none, float(k)) for k, v in enumerate(values)]
        sick = sum(bool(h.sick) for h in health)
        named = sorted({f"E{e.electrode + 1} {e.state}" for h in health for e in h.sick})
        lost = int(np.median([h.lost.sum() for h in health]))
        what = "pressed" if (name, key) in PRESSED else "untouched"
        said = ", ".join(named[:4]) + (" …" if len(named) > 4 else "") or "–"
        rows.append((name.split("/")[1], what, len(values), pattern.n_meas, sick, lost, said))
    return Report(
        "electrode health on recordings",
        (
            "recording",
            "frames",
            "how many",
            "rows",
            "with a sick electrode",
            "rows lost, median",
            "which",
        ),
        tuple(rows),
        (
            "voltages only, the reference from the first 20 untouched frames and not followed; "
            "nothing is known of these skins' electrodes, so an alarm may be right",
        ),
    )
