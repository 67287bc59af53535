"""A multiplexer that does not reach an electrode is named, and nothing else is taken for it."""

import numpy as np
import pytest

from tomoskin.model.pattern import Pattern, Scan
from tomoskin.sensing.signal.evidence import EqualReadings, Reciprocity

LOOKS = 40
NOISE = 2e-3


def misread(disc, potentials, electrode, read):
    """The samples where ``read`` is read for ``electrode``; a driven one stands high or low."""
    scan, samples = disc.scan, potentials.copy()
    for drive, (source, _) in enumerate(scan.drives.tolist()):
        here = scan.sample_drive == drive
        mine = here & (scan.sample_electrode == electrode)
        other = here & (scan.sample_electrode == read)
        samples[mine] = samples[other] if other.any() else 3.0 if read == source else -3.0
    return samples


def sick(watched, potentials):
    for _ in range(LOOKS):
        health = watched.push(potentials)
    return {e.electrode: (e.state, e.reason) for e in health.sick}


@pytest.mark.parametrize(("electrode", "read"), [(3, 4), (4, 3), (2, 9), (0, 7)])
def test_one_that_is_not_reached_from_the_start_is_named_with_what_is_read(
    disc, watch, monkeypatch, electrode, read
):
    plain = type(disc).potentials
    monkeypatch.setattr(
        type(disc), "potentials", lambda self, s=0.0: misread(self, plain(self, s), electrode, read)
    )
    watched = watch(disc)
    found = sick(watched, disc.potentials())
    assert found[electrode][0] == "stuck"
    assert f"reads as E{read + 1} does under every drive" in found[electrode][1]
    assert [e for e in found if "multiplexer" in found[e][1]] == [electrode]


def test_one_that_is_reached_no_longer_is_named_too(disc, watched):
    assert sick(watched, disc.potentials()) == {}
    found = sick(watched, misread(disc, disc.potentials(), 2, 9))
    assert "reads as E10 does" in found[2][1]
    found = sick(watched, disc.potentials())
    assert not any("multiplexer" in reason for _, reason in found.values())


@pytest.mark.parametrize("squeeze", [-0.2, 0.0, 0.2])
def test_neighbours_that_come_close_are_not(disc, watched, squeeze):
    assert not any("multiplexer" in r for _, r in sick(watched, disc.potentials(squeeze)).values())


def test_two_that_touch_each_other_are_not(disc):
    """Reciprocity holds where two electrodes are one."""
    rng, n = np.random.default_rng(4), disc.pattern.n_electrodes
    half = rng.standard_normal((n, n))
    resistance = half @ half.T
    join = np.eye(n)
    join[[3, 3, 8, 8], [3, 8, 3, 8]] = 0.5
    resistance = join @ resistance @ join
    source, sink = disc.scan.drives[disc.scan.sample_drive].T
    e = disc.scan.sample_electrode
    volts = resistance[source, e] - resistance[sink, e]
    counts = np.round(20000 + 1000 * volts).astype(np.uint16)
    equal = EqualReadings.of(disc.scan, n)
    assert equal(counts, disc.rows(volts), Reciprocity.of(disc.pattern)) == {}


@pytest.mark.parametrize("n", [4, 8, 32])
def test_noise_alone_is_not(n):
    pattern = Pattern.adjacent(n)
    scan, rng = Scan.of(pattern), np.random.default_rng(n)
    equal, reciprocity = EqualReadings.of(scan, n), Reciprocity.of(pattern)
    for _ in range(20):
        volts = NOISE * rng.standard_normal(scan.n_samples)
        counts = np.round(500 + 2000 * volts).astype(np.uint16)
        assert equal(counts, volts[scan.plus] - volts[scan.minus], reciprocity) == {}
    same = np.full(scan.n_samples, 7, np.uint16)
    assert equal(same, np.zeros(pattern.n_meas), reciprocity) == {}
