"""Touches in noise that no skin file foresees: false ones on an idle skin, and what is missed."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from noisy_board import Floats, Noise, NoisyBoard
from report import Report, progress
from tomoskin.model.skin import Skin
from tomoskin.pipeline import Pipeline, Prepared, prepare, voltage_covariance
from tomoskin.sensing.fit import Whitener

SKINS = ("textile-disc-8", "textile-disc-16")
SEED = 31
"""What was chosen was chosen on seeds 1 to 5."""

NEEDED, FRAMES, AFTER = 30, 10_000, 500

CASES = {
    "as the skin file says": Noise(),
    "three times as loud": Noise(samples=3.0),
    "rows independent": Noise(samples=0.0, rows=1.0),
    "half of it shared": Noise(samples=0.7, rows=0.7),
    "hum, 3 times the noise": Noise(hum=3.0),
    "drift, 1 % in 300 s, and walk": Noise(drift=0.01, walk=1.0),
    "one electrode ten times as loud": Noise(loud=10.0, every=FRAMES // 2),
}


def run(data: Path | None) -> tuple[Report, ...]:
    """No recordings are needed."""
    del data
    prepared = {name: fitted(name) for name in SKINS}
    return _false(prepared), _missed(prepared)


def fitted(name: str) -> Prepared:
    """A built-in skin whose touches are fitted."""
    return prepare(Skin.load(name).altered({"touch": {"method": "fit"}}))


def false_touches(prepared: Prepared, noise: Noise, seed: int, frames: int) -> tuple[int, int, int]:
    """Touches, frames with one, and frames in which something is said to be wrong, of so many."""
    pipeline, board = Pipeline(prepared, reference_frames=NEEDED), NoisyBoard(prepared, noise, seed)
    numbers: set[int] = set()
    touched = said = 0
    for frame in board.frames(NEEDED + frames):
        result = pipeline.push(frame)
        assert result is not None
        numbers |= {touch.id for touch in result.touches}
        touched += bool(result.touches)
        said += result.problem is not None
    return len(numbers), touched, said


def _false(prepared: dict[str, Prepared]) -> Report:
    rows = []
    for name, skin in prepared.items():
        for case, noise in CASES.items():
            progress(f"{name}, {case}")
            rows.append((name, case, *false_touches(skin, noise, SEED, FRAMES)))
    return Report(
        f"an untouched skin, {FRAMES} frames",
        ("skin", "noise", "false touches", "frames with one", "frames with a problem said"),
        tuple(rows),
        (
            f"live pipeline, 20 frames/s, reference of {NEEDED} frames, seed {SEED}; noise in "
            "parts of the read-out's; hum of 50 Hz beats with the scan; the loud electrode is so "
            "in the second half",
        ),
    )


def least_found(prepared: Prepared, noise: Noise, seed: int, frames: int) -> Floats:
    """(n,) content at which a faint touch stands out by five, in parts of what it needed if the
    noise were known; after so many idle frames."""
    pipeline, board = Pipeline(prepared, reference_frames=NEEDED), NoisyBoard(prepared, noise, seed)
    for frame in board.frames(NEEDED + frames):
        pipeline.push(frame)
    reference, spots = pipeline.reference, prepared.spots
    assert reference is not None
    assert spots is not None
    gain = reference.mean[:, None]
    known = Whitener.of(board.covariance(0) * (1 + 1 / NEEDED)).without(gain)
    learnt = Whitener.of(voltage_covariance(prepared, reference)).without(gain)
    ideal, real = (
        np.linalg.norm(white(spots.candidates.signatures), axis=1) for white in (known, learnt)
    )
    return np.asarray(ideal / real)


def _missed(prepared: dict[str, Prepared]) -> Report:
    rows = []
    for name, skin in prepared.items():
        for case, noise in CASES.items():
            if noise.loud != 1.0 or noise.walk:
                continue
            progress(f"{name}, {case}, faint touches")
            needed = [least_found(skin, noise, SEED, frames) for frames in (0, AFTER)]
            figures = [round(float(f(n)), 3) for n in needed for f in (np.median, np.max)]
            rows.append((name, case, *figures))
    return Report(
        "content that a faint touch needs, in parts of what it needed if the noise were known",
        (
            *("skin", "noise", "after the reference, median", "worst place"),
            *(f"after {AFTER} frames more, median", "worst place "),
        ),
        tuple(rows),
        (
            f"all candidates of the sheet, reference of {NEEDED} frames, seed {SEED}; the ideal: "
            "the true covariance, and the noise of the reference",
        ),
    )
