"""Touches in noise that no skin file foresees: false ones on an idle skin, and what is missed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from report import Floats, Report, progress, table
from tomoskin.core import Frame
from tomoskin.model.skin import Skin
from tomoskin.pipeline import Pipeline, Prepared, prepare, voltage_covariance
from tomoskin.sensing.fit import Whitener

PERIOD, BUSY = 0.05, 0.9
"""Seconds between two frames, and the part of them in which samples are read."""


@dataclass(frozen=True)
class Noise:
    """Noise beside that of the read-out, of which one row has the deviation 1.

    ``samples``: of each, in parts of the read-out's; ``rows``: of each by itself, as a differential
    board's; ``hum`` of the mains in a row, rms, with ``advance`` turns between frames; ``drift``:
    part by which all voltages rise and fall in 300 s; ``walk`` of each electrode in 30 s; ``loud``:
    times as loud as the others one electrode becomes, another one after ``every`` so many frames.
    """

    samples: float = 1.0
    rows: float = 0.0
    hum: float = 0.0
    advance: float = 0.13
    drift: float = 0.0
    walk: float = 0.0
    loud: float = 1.0
    every: int = 1000


class NoisyBoard:
    """A board on an untouched skin; ``volts`` (n_meas,) that a touch adds may be set."""

    def __init__(self, prepared: Prepared, noise: Noise, seed: int) -> None:
        self.prepared, self.noise = prepared, noise
        self.random = np.random.default_rng(seed)
        scan, readout = prepared.scan, prepared.readout
        self.makes = scan.makes
        self.inverse = np.linalg.pinv(self.makes)
        self.unit = readout.noise / readout.volts_per_count
        self.rest = self._rest()
        self.electrode = scan.sample_electrode
        self.n = prepared.skin.n_electrodes
        self.hum = (1 + 0.5 * self.random.standard_normal(self.n))[self.electrode]
        self.mains = 2 * np.pi * (np.arange(scan.n_samples) / scan.n_samples * BUSY * PERIOD * 50.0)
        size = self.makes @ (self.hum * np.exp(1j * self.mains))
        self.hum *= noise.hum * self.unit / np.sqrt(np.mean(np.abs(size) ** 2) / 2)
        self.phase = self.random.uniform(0, 2 * np.pi)
        self.offset = np.zeros(scan.n_samples)
        self.volts: Floats = np.zeros(len(scan.plus))

    def _rest(self) -> Floats:
        """(n_samples,) counts without noise."""
        prepared = self.prepared
        scan, settings = prepared.scan, prepared.skin.readout
        potentials = prepared.model.solve(prepared.skin.conductivity).electrode_potentials
        ground = potentials[scan.sample_drive, scan.drives[scan.sample_drive, 1]]
        volts = settings.gain * (potentials[scan.sample_drive, scan.sample_electrode] - ground)
        full = settings.oversampling * (2**settings.adc_bits - 1)
        return np.asarray((volts + settings.offset) / settings.reference_voltage * full)

    def loud(self, number: int) -> Floats:
        """(n_samples,) times by which each sample wavers more."""
        times, since = np.ones(len(self.rest)), number // self.noise.every
        if self.noise.loud != 1.0 and since:
            times[self.electrode == (3 * since) % self.n] = self.noise.loud
        return times

    def covariance(self, number: int) -> Floats:
        """(n_meas, n_meas) V² of the noise of a frame, but for drift."""
        noise, readout = self.noise, self.prepared.readout
        sd = noise.samples * self.loud(number) / np.sqrt(2)
        both = (self.makes * sd**2) @ self.makes.T + noise.rows**2 * np.eye(len(self.makes))
        wave = self.makes @ (self.hum * np.exp(1j * self.mains)) / self.unit
        both += (np.outer(wave.real, wave.real) + np.outer(wave.imag, wave.imag)) / 2
        return np.asarray(both * readout.noise**2)

    def counts(self, number: int) -> Floats:
        """(n_samples,) of frame ``number``, before they are rounded."""
        noise, random, time = self.noise, self.random, PERIOD * number
        sd = noise.samples * self.loud(number) * self.unit / np.sqrt(2)
        counts = self.rest * (1 + noise.drift * np.sin(2 * np.pi * time / 300.0))
        counts = counts + sd * random.standard_normal(len(sd))
        if noise.rows:
            counts += self.inverse @ (
                noise.rows * self.unit * random.standard_normal(len(self.makes))
            )
        if noise.hum:
            turn = self.phase + 2 * np.pi * noise.advance * number
            counts += self.hum * np.sin(self.mains + turn)
        if noise.walk:
            step = noise.walk * self.unit / np.sqrt(2 * 30.0 / PERIOD)
            self.offset += step * random.standard_normal(len(self.offset))
            counts += self.offset
        return counts + self.inverse @ (self.volts / self.prepared.readout.volts_per_count)

    def frames(self, count: int, first: int = 0) -> Iterator[Frame]:
        """Frames as the pipeline takes them."""
        settings = self.prepared.skin.readout
        most = settings.oversampling * (2**settings.adc_bits - 1)
        for number in range(first, first + count):
            samples = np.clip(np.round(self.counts(number)), 0, most).astype(np.uint16)
            time = PERIOD * number
            yield Frame(number, round(time * settings.tick_rate), time, 1, 0, 0, samples)


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


def run() -> Iterator[Report]:
    prepared = [fitted(name) for name in SKINS]
    yield table(
        f"an untouched skin, {FRAMES} frames",
        (row for skin in prepared for row in _false(skin)),
        f"live pipeline, 20 frames/s, reference of {NEEDED} frames, seed {SEED}; noise in "
        "parts of the read-out's; hum of 50 Hz beats with the scan; the loud electrode is so "
        "in the second half",
    )
    yield table(
        "content that a faint touch needs, in parts of what it needed if the noise were known",
        (row for skin in prepared for row in _missed(skin)),
        f"all candidates of the sheet, reference of {NEEDED} frames, seed {SEED}; the ideal: "
        "the true covariance, and the noise of the reference",
    )


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


def _false(prepared: Prepared) -> Iterator[dict[str, Any]]:
    columns = ("false touches", "frames with one", "frames with a problem said")
    for case, noise in CASES.items():
        progress(f"{prepared.skin.name}, {case}")
        counts = zip(columns, false_touches(prepared, noise, SEED, FRAMES), strict=True)
        yield {"skin": prepared.skin.name, "noise": case, **dict(counts)}


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


def _missed(prepared: Prepared) -> Iterator[dict[str, Any]]:
    for case, noise in CASES.items():
        if noise.loud != 1.0 or noise.walk:
            continue
        progress(f"{prepared.skin.name}, {case}, faint touches")
        row = {"skin": prepared.skin.name, "noise": case}
        for name, frames in (("after the reference", 0), (f"after {AFTER} frames more", AFTER)):
            needed = least_found(prepared, noise, SEED, frames)
            row |= {f"{name}, median": round(float(np.median(needed)), 3)}
            row |= {f"{name}, worst place": round(float(np.max(needed)), 3)}
        yield row
