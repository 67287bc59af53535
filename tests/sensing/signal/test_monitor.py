"""Electrode health: what is called sick, why and when, and that a press is not."""

from __future__ import annotations

import numpy as np
import pytest

from tomoskin.sensing.signal.monitor import LEAVE

RAIL = 5.0


def cut(disc, *electrodes, rail=RAIL):
    """Potentials with these electrodes off: their drives carry nothing, they float to a rail."""
    found = disc.potentials()
    off = np.isin(disc.scan.drives, electrodes).any(axis=1)[disc.scan.sample_drive]
    found[off] = 0.3
    found[np.isin(disc.scan.sample_electrode, electrodes)] = rail
    return found


def states(health):
    return {e.electrode: e.state for e in health.sick}


def test_a_well_skin_is_well(watched, disc):
    for _ in range(400):
        health = watched.push(disc.potentials())
        assert not health.sick
        assert not health.lost.any()
    assert health.text is None


@pytest.mark.parametrize("squeeze", [0.05, 0.15, 0.3])
def test_a_press_is_no_sick_electrode(watched, disc, squeeze):
    for frame in range(150):
        health = watched.push(disc.potentials(squeeze if frame % 7 < 4 else 0.0))
        assert not health.sick


@pytest.mark.parametrize("electrodes", [(5,), (5, 6), (4, 6), (0, 15), (2, 9)])
def test_electrodes_that_are_cut_off_are_noticed_in_two_frames(watched, disc, electrodes):
    watched.push(disc.potentials())
    first = watched.push(cut(disc, *electrodes), RAIL)
    assert not first.sick
    read = np.isin(disc.pattern.measure, electrodes).any(axis=1)
    driven = np.isin(disc.pattern.drive, electrodes).any(axis=1)
    assert (first.lost | first.floating[disc.pattern.measure].any(axis=1))[read | driven].all()
    second = watched.push(cut(disc, *electrodes), RAIL)
    assert states(second) == dict.fromkeys(electrodes, "open")
    assert f"E{electrodes[0] + 1} is open: no current" in second.text
    assert second.sick[0].since == pytest.approx(0.3)
    assert np.array_equal(second.lost, driven)
    assert np.flatnonzero(second.floating).tolist() == sorted(electrodes)


def test_an_open_electrode_that_floats_between_the_rails(watched, disc):
    for _ in range(3):
        floats = cut(disc, 7, rail=0.0)
        own = disc.scan.sample_electrode == 7
        floats[own] += 0.5 * watched.random.standard_normal(own.sum())
        health = watched.push(floats)
    assert states(health) == {7: "open"}


def test_a_channel_at_its_rail_still_drives(watched, disc):
    railed = disc.potentials()
    railed[disc.scan.sample_electrode == 3] = RAIL
    for _ in range(3):
        health = watched.push(railed, RAIL)
    assert states(health) == {3: "railed"}
    assert not health.lost.any()
    assert np.flatnonzero(health.floating).tolist() == [3]


def test_a_short(watched, disc):
    shorted = disc.potentials()
    for drive, pair in enumerate(disc.scan.drives.tolist()):
        own = disc.scan.sample_drive == drive
        here = [np.flatnonzero(own & (disc.scan.sample_electrode == e)) for e in (8, 9)]
        if set(pair) == {8, 9}:
            shorted[own] = 0.2
        elif all(len(place) for place in here):
            shorted[here[1]] = shorted[here[0]]
    for _ in range(3):
        health = watched.push(shorted)
    assert states(health) == {8: "short", 9: "short"}
    assert "E9 under every drive" in health.electrodes[9].text


def test_a_channel_that_stands_still(watched, disc):
    held = watched.noisy(disc.potentials())[disc.scan.sample_electrode == 2]
    for frame in range(12):
        scan = watched.disc.scan
        noisy = watched.noisy(disc.potentials())
        noisy[scan.sample_electrode == 2] = held
        counts = np.round(20000 + 5000 * noisy).astype(np.uint16)
        none = np.zeros(disc.pattern.n_meas, bool)
        health = watched.monitor.push(disc.rows(noisy), none, 0.1 * frame, counts)
    assert states(health) == {2: "stuck"}


def test_frames_that_all_stand_still_blame_nobody(disc, watched):
    counts = np.full(disc.scan.n_samples, 20000, np.uint16)
    rows, none = disc.rows(disc.potentials()), np.zeros(disc.pattern.n_meas, bool)
    for frame in range(30):
        assert not watched.monitor.push(rows, none, 0.1 * frame, counts).sick


def test_a_channel_that_is_noisy_and_one_that_is_wrong(watched, disc):
    own = disc.scan.sample_electrode == 11
    for _ in range(120):
        noisy = disc.potentials()
        noisy[own] += 6 * 2e-3 * watched.random.standard_normal(own.sum())
        health = watched.push(noisy)
    assert states(health) == {11: "noisy"}
    assert "times the noise" in health.text


def test_a_channel_whose_gain_is_off_is_inconsistent(watched, disc):
    wrong = disc.potentials()
    wrong[disc.scan.sample_electrode == 4] += 0.03
    for _ in range(60):
        health = watched.push(wrong)
    assert states(health) == {4: "inconsistent"}


def test_a_mended_electrode_comes_back_after_a_while(watched, disc):
    for _ in range(3):
        assert watched.push(cut(disc, 5), RAIL) is not None
    back = [bool(watched.push(disc.potentials()).sick) for _ in range(LEAVE + 5)]
    assert back[: LEAVE - 1] == [True] * (LEAVE - 1)
    assert not any(back[LEAVE:])


def test_a_single_bad_sample_loses_its_rows_for_one_frame(watched, disc):
    wild = disc.potentials()
    wild[100] = RAIL
    health = watched.push(wild, RAIL)
    assert not health.sick
    assert 1 <= health.lost.sum() <= 2
    assert not watched.push(disc.potentials()).lost.any()
