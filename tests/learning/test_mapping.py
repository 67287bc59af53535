"""The wiring that labelled presses tell, on the twin with every scramble."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from labelled_presses import labelled_presses
from tomoskin.core import DataError, FloatArray
from tomoskin.learning import ChannelMapping, ring_of, solve_channel_mapping
from tomoskin.model.pattern import match_rows
from tomoskin.model.skin import Skin

SKIN = Skin.load("textile-disc-8")
RING = ring_of(SKIN)
N = SKIN.n_electrodes

wirings = st.builds(
    lambda steps, mirrored, swap, polarity: replace(
        ChannelMapping.as_drawn(N).turned(RING, steps, mirrored=mirrored).swapped(*swap),
        reversed=polarity,
    ),
    st.integers(0, N - 1),
    st.booleans(),
    st.sampled_from([(0, 0), (2, 3), (1, 6)]),
    st.booleans(),
)


def pressed(
    wiring: ChannelMapping, seed: int, n: int = 12
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Changes, labels and reference of a twin that is wired so."""
    true = replace(wiring, reversed=False).applied(SKIN)
    arrays = labelled_presses(true, seed, n)
    single = np.isfinite(arrays["xy_m"]).all(axis=1)
    sign = -1.0 if wiring.reversed else 1.0
    reference = sign * arrays["reference"]
    return (
        (sign * arrays["voltages"] - reference)[single],
        arrays["xy_m"][single],
        reference,
    )


_REMARKED = 53


@settings(max_examples=5)
@given(wirings, st.integers(0, 99))
def test_five_presses_tell_any_scramble(wiring: ChannelMapping, seed: int) -> None:
    dv, xy, reference = pressed(wiring, seed)
    found = solve_channel_mapping(dv[:5], xy[:5], SKIN, reference=reference)
    assert found.sure
    assert found.mapping == wiring
    assert found.odds > 19
    # of the 500 sound presses of these seeds, one is remarked on with some wirings
    assert len(found.contradicted) <= (seed == _REMARKED)


def test_one_press_in_the_middle_tells_nothing() -> None:
    """All rotations look alike; a press out at the rim would tell."""
    dv, xy, reference = pressed(ChannelMapping.as_drawn(N), 3)
    near = int(np.argmin(np.linalg.norm(xy, axis=1)))
    middle = np.zeros((1, 2))
    found = solve_channel_mapping(dv[near : near + 1], middle, SKIN, reference=reference)
    assert not found.sure
    assert found.odds < 19
    assert np.linalg.norm(found.next_place) > 0.02


def test_polarity_needs_a_sign() -> None:
    wiring = replace(ChannelMapping.as_drawn(N), reversed=True)
    dv, xy, reference = pressed(wiring, 5)
    either = SKIN.altered({"touch": {"sign": "both"}})
    found = solve_channel_mapping(dv[:8], xy[:8], either)
    assert not found.polarity_known
    assert found.mapping.electrodes == wiring.electrodes
    assert solve_channel_mapping(dv[:8], xy[:8], either, reference=reference).mapping == wiring
    assert solve_channel_mapping(dv[:8], xy[:8], SKIN).mapping == wiring


def test_noise_is_no_wiring() -> None:
    dv, xy, _ = pressed(ChannelMapping.as_drawn(N), 5)
    nothing = np.random.default_rng(0).normal(size=dv.shape) * np.std(dv)
    assert not solve_channel_mapping(nothing, xy, SKIN).sure


def test_a_wrong_label_is_named() -> None:
    dv, xy, reference = pressed(ChannelMapping.as_drawn(N), 7)
    outer = int(np.argmax(np.linalg.norm(xy, axis=1)))
    wrong = xy.copy()
    wrong[outer] = -wrong[outer]
    found = solve_channel_mapping(dv, wrong, SKIN, reference=reference)
    assert found.mapping == ChannelMapping.as_drawn(N)
    (remark,) = found.contradicted
    assert remark[0] == outer
    assert np.linalg.norm(np.array(remark[1:]) - xy[outer]) < 0.04


def test_a_wired_skin_answers_as_the_wires_do() -> None:
    """What is read through scrambled wires is what the wired skin's own model says."""
    wiring = replace(
        ChannelMapping.as_drawn(N).turned(RING, 3, mirrored=True).swapped(0, 5), reversed=True
    )
    wired = wiring.applied(SKIN)
    assert wired.polarity == -1
    assert wired.n_electrodes == N
    np.testing.assert_allclose(
        wired.electrode_centres, SKIN.electrode_centres[list(wiring.electrodes)], atol=2e-5
    )
    assert wired.identity != SKIN.identity
    again = replace(ChannelMapping.as_drawn(N), reversed=True).applied(wired)
    assert again.polarity == 1
    mixed = SKIN.altered({"electrodes": {"contact_impedance": [f"{k} ohm*m" for k in range(1, 9)]}})
    np.testing.assert_allclose(
        wiring.applied(mixed).contact_impedance, 1.0 + np.array(wiring.electrodes)
    )


@pytest.mark.parametrize(
    ("wiring", "words"),
    [
        (ChannelMapping.as_drawn(8), "as the skin file says"),
        (ChannelMapping.as_drawn(8).turned(RING, 1, mirrored=False), "turned by 1 electrode"),
        (
            replace(ChannelMapping.as_drawn(8).turned(RING, 2, mirrored=True), reversed=True),
            "mirrored, turned by 2 electrodes, polarity reversed",
        ),
        (
            ChannelMapping.as_drawn(8).swapped(2, 3),
            "E3 at the position of E4, E4 at the position of E3",
        ),
    ],
)
def test_a_wiring_in_words(wiring: ChannelMapping, words: str) -> None:
    assert wiring.text(RING) == words


def test_electrodes_are_followed_along_the_rim() -> None:
    shuffled = ChannelMapping((0, 3, 1, 2, 7, 5, 6, 4)).applied(SKIN)
    ring = ring_of(shuffled)
    centres = shuffled.electrode_centres[list(ring)]
    steps = np.linalg.norm(centres - np.roll(centres, 1, axis=0), axis=1)
    np.testing.assert_allclose(steps, steps[0], rtol=1e-3)
    assert ring_of(SKIN) == tuple(range(8))


def test_what_cannot_be_is_refused() -> None:
    dv, xy = np.ones((3, 40)), np.full((3, 2), 0.02)
    with pytest.raises(DataError, match="within 10 m"):
        solve_channel_mapping(dv, 1e3 * xy, SKIN)
    with pytest.raises(DataError, match="40 rows"):
        solve_channel_mapping(dv[:, :8], xy, SKIN)
    with pytest.raises(DataError, match="change the voltages"):
        solve_channel_mapping(np.zeros((3, 40)), xy, SKIN)
    with pytest.raises(DataError, match="xy of shape"):
        solve_channel_mapping(dv, xy[:2], SKIN)


@pytest.mark.data
@pytest.mark.parametrize("steps", [0, 5])
def test_a_public_skin_is_oriented(data_dir: Path, steps: int) -> None:
    """Within one electrode of what the set's notes state, which is fitted to a few degrees."""
    place = {"count": 16, "first": "-99 deg", "order": "counter-clockwise", "width": "5 mm"}
    skin = Skin.load("textile-disc-16").altered(
        {
            "outline": {"shape": "disc", "diameter": "170 mm"},
            "electrodes": place | {"positions": None},
            "drive": {"pattern": "opposite"},
            "mesh": {"cells": 1000},
            "touch": {"sign": "both"},
        }
    )
    with np.load(data_dir / "eskin_hydrogel_round" / "round16_single550.npz") as kept:
        half = len(kept["inj"]) // 2  # each drive stands twice
        match = match_rows(skin.pattern(), kept["inj"][:half], kept["meas"][:half])
        dv = match.apply((kept["v_down"].astype(float) - kept["v_up"])[:, :half])
        xy = 1e-3 * kept["xy_mm"].astype(float)
    chosen = np.random.default_rng(0).permutation(len(dv))[:15]
    turned = ChannelMapping.as_drawn(16).turned(ring_of(skin), steps, mirrored=True).applied(skin)
    found = solve_channel_mapping(dv[chosen], xy[chosen], turned)
    assert found.sure
    centres = found.mapping.applied(turned).electrode_centres
    apart = np.linalg.norm(centres - skin.electrode_centres, axis=1)
    assert (
        apart < 1.1 * np.linalg.norm(skin.electrode_centres[0] - skin.electrode_centres[1])
    ).all()


def test_labels_of_other_presses_make_no_sure_answer() -> None:
    """Each label stands beside the data of another press: no wiring can be right."""
    dv, xy, reference = pressed(ChannelMapping.as_drawn(N), 7)
    found = solve_channel_mapping(dv, np.roll(xy, 3, axis=0), SKIN, reference=reference)
    assert not found.sure
    assert found.doubtful
