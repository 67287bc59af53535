"""The Pico's front end under ngspice: quiet, fast and cheap enough, as docs/hardware.md says."""

import pytest

import front_end
import results

pytestmark = pytest.mark.usefixtures("decks")


def test_it_is_four_times_as_quiet_as_the_mega():
    ours, mega = front_end.noise(), front_end.mega_noise()
    assert mega["total"] / ours["total"] > 4
    assert mega["ohms"] / ours["ohms"] > 4
    own = front_end.noise(converter=front_end.OWN_NOISE)
    assert mega["total"] / own["total"] < 4  # why it has a converter of its own


def test_it_settles_within_three_conversions_after_the_multiplexer():
    """Of 2 us; what U7 takes from the filter with each conversion is in it."""
    steps = [(step, contact) for step in (0.025, 0.06) for contact in (0.1, 20)]
    assert max(front_end.settling(*step) for step in steps) < 5e-6
    assert results.shared()["settling"] > 50e-6  # of the Mega's amplifier, which is slower


@pytest.mark.parametrize("gap", [40e-9, -40e-9])
def test_a_tree_for_32_electrodes_settles_within_three_conversions_too(gap):
    assert front_end.settling_of_tree(0.06, gap) < 5e-6
    assert front_end.cost(32) > front_end.cost(16) + 20


@pytest.mark.parametrize("minus", [2.1, 2.9])
def test_an_open_sink_does_not_hurt_what_reads(minus):
    """An ADS7042's input may have -0.3 V to 0.3 V above its supply, and 10 mA."""
    found = front_end.open_sink(minus)
    assert -0.301 < found["pin"] < 3.6
    assert abs(found["amperes"]) < 5e-3
    before = front_end.open_sink(2.9, limit=330)
    assert before["pin"] < -0.34
    assert before["amperes"] < -13e-3


def test_its_current_holds():
    found = front_end.drive()
    assert found["current_error"] < 0.005
    assert found["load"] >= 50


@pytest.mark.parametrize("contact", [0.1, 20])
@pytest.mark.parametrize("dead", ["0.2u", "10u"])
def test_a_drive_begins_without_a_spike_because_of_the_dump(contact, dead):
    begun = front_end.beginning(contact, dead)
    assert begun["peak"] < 1.05
    assert begun["settling"] < 4e-6
    assert front_end.beginning(contact, dead, dump=1e9)["peak"] > 1.2


def test_its_parts_cost_what_the_page_says():
    assert front_end.cost() <= 50
    assert front_end.cost(32) <= 80
