"""The board's circuit under ngspice: ours keeps its promises, the source's shows what was wrong."""

import math

import pytest

import parasitics
import results
from spice import DECKS, DeckError, run
from tomoskin.board.source import ScanSettings
from tomoskin.model.skin import Skin

pytestmark = pytest.mark.usefixtures("decks")
OFF, ON, SOUND, BROKEN = 0, 5, "1g", "50m"


def test_the_current_holds_to_a_percent_and_says_where_it_ends():
    rest = results.compliance("mended")
    assert rest["current_error"] < 0.01 - 0.002  # less reference and sense resistor, 0.1 % each
    assert rest["compliance"] > 10
    assert results.compliance("source")["compliance"] < 9.5


def test_an_lm317_cannot_make_a_milliampere():
    loads = "0.5 20 1000 2000"
    wrong = run("compliance", variant="source", loads=loads, amps=1e-3)["amperes"]
    right = run("compliance", variant="mended", loads=loads, amps=1e-3)["amperes"]
    assert min(wrong) > 3e-3
    assert right == pytest.approx([1e-3] * 4, rel=0.01)


@pytest.mark.parametrize(
    ("contact", "ring", "gain"), [(0.05, 1, 35), (0.05, 0.3, 35), (0.05, 5, 7), (20, 1, 35)]
)
def test_nothing_spikes_and_all_settles(contact, ring, gain):
    step = results.switching("mended", contact=contact, ring=ring, gain=gain)
    assert step["peak"] < 1.3
    assert step["settling"] < 200e-6
    assert step["settling"] < Skin.load("textile-disc-8").readout.settling


@pytest.mark.parametrize("dead", ["1u", "10u", "100u"])
def test_the_dead_time_does_not_matter(dead):
    assert results.switching("mended", dead=dead)["peak"] < 1.3


def test_without_a_dump_the_bus_charges_and_spikes_into_the_skin():
    peaks = [results.switching("source", dead=dead)["peak"] for dead in ("0.2u", "2u", "10u")]
    assert peaks == sorted(peaks)
    assert peaks[1] > 4
    assert peaks[2] > 8


def test_a_demultiplexer_of_5_v_does_not_switch_a_high_side_off():
    wrong, right = (results.switching(one, dead="100u") for one in ("source", "mended"))
    assert wrong["bus"] > 10
    assert wrong["idle_peak"] > 0.5
    assert right["idle_peak"] < 0.15


def test_after_a_cut_electrode_the_hosts_dead_time_is_enough():
    assert results.switching("mended", cut="1g")["peak"] < 1.3
    assert 1.3 < results.switching("mended", cut="1g", dead="2u")["peak"] < 2
    assert results.switching("source", cut="1g", dead="10u")["peak"] > 8
    default = ScanSettings(1, 1e-3, 0.1, 10).dead_time
    assert f"{default * 1e6:g}u" == results.DEAD_TIME


@pytest.mark.parametrize(("contact", "amperes"), [(1, 0.1), (20, 0.1), (20, 0.01), (100, 0.01)])
def test_resistive_contacts_clip_what_reads_against_the_sink_line(contact, amperes):
    wrong = results.clipping("source", contact, amperes)
    right = results.clipping("mended", contact, amperes)
    assert wrong["read"] < 0.5 * wrong["truth"]
    assert right["read"] == pytest.approx(right["truth"], rel=1e-3)
    assert right["pin"] < 4


def test_noise_is_the_converters():
    quiet, loud = results.noise(0), results.noise(1 / results.GAIN)
    assert quiet["pin"] < loud["pin"] < 0.1 * results.CONVERTER_NOISE * results.LSB
    assert quiet["gain"] == pytest.approx(results.GAIN, rel=1e-3)


def test_noise_is_that_on_paper():
    """12 nV of amplifier and 4.07 for each 1 kohm of the two 3.3 before it: docs/hardware.md."""
    quiet = results.noise(0)
    density = math.sqrt(12**2 + 2 * 3.3 * 4.07**2) * 1e-9
    paper = results.GAIN * density * math.sqrt(math.pi / 2 * quiet["bandwidth"])
    assert quiet["pin"] == pytest.approx(paper, rel=0.1)


@pytest.mark.parametrize("five", [OFF, ON])
def test_floating_pins_drive_nothing(five):
    safe = run("powerup", variant="mended", pull="10k", five=five)
    assert safe["person"][0] < 1e-9
    assert safe["skin"][0] < 1e-9
    wrong = run("powerup", variant="source", pull="1g", five=five)
    assert wrong["skin"][0] > 5e-3


ARDUINO, LIFTED = "100", "1g"
"""ohm: what an Arduino without power draws from 5 V, about; a board that was lifted off it."""


def rails(variant, channels, usb, pull="1", mega=ARDUINO, *, jack="12"):
    """Figures of the rails; ``jack`` V, which come or, at 0, do not."""
    values = {"usb": usb, "pull": pull, "mega": mega, "jack": jack}
    said = run("rails", variant=variant, channels=channels, **values)
    return {name: value[0] for name, value in said.items()}


@pytest.mark.parametrize("channels", [8, 16])
@pytest.mark.parametrize(("usb", "pull"), [(OFF, "1"), (ON, "100m")], ids=["never", "pulled"])
def test_12_v_without_5_v_stays_at_the_jack(channels, usb, pull):
    wrong = rails("bare", channels, usb, pull)
    assert wrong["substrate"] == pytest.approx(0.35e-3 * channels, rel=0.05)  # through U1
    assert wrong["above"] > 0.6
    assert wrong["five"] > 0.4
    for mega in (ARDUINO, LIFTED):
        ours = rails("mended", channels, usb, pull, mega)
        assert ours["substrate"] < 1e-6
        assert ours["above"] < 0.1
        assert abs(ours["twelve"]) < 1
        assert ours["five"] < 0.01


@pytest.mark.parametrize("channels", [8, 16])
def test_with_5_v_the_rails_are_as_without_the_switch(channels):
    wrong, ours = (rails(variant, channels, ON) for variant in ("bare", "mended"))
    assert ours["twelve"] == pytest.approx(wrong["twelve"], abs=0.01)
    assert ours["negative"] == pytest.approx(wrong["negative"], abs=0.01)
    assert -5 < ours["negative"] < -4.16  # as the first power-up asks


@pytest.mark.parametrize("channels", [8, 16])
def test_with_usb_alone_a_diode_holds_12_v_near_ground(channels):
    """The amplifiers draw +12V down: what else holds it are body diodes, at -0.6 V and below."""
    ours = rails("mended", channels, ON, jack="0")
    assert -0.35 < ours["below"] <= ours["twelve"] < 0
    assert -5 < ours["negative"] < -4.4
    assert ours["five"] == pytest.approx(5, abs=0.02)
    text = (DECKS / "rails.cir").read_text(encoding="utf-8")
    bare = text.replace("FLOOR_@variant@", "FLOOR_bare")
    assert bare != text
    with_body_diodes = rails_of(bare, channels)
    assert with_body_diodes < -0.5


def rails_of(deck, channels):
    """The lowest +12V of a deck's text, with our switch and USB alone."""
    file = DECKS / "rails_without_diode.cir"
    file.write_text(deck, encoding="utf-8")
    try:
        values = {"usb": ON, "pull": "1", "mega": ARDUINO, "jack": "0"}
        return run(file.stem, variant="mended", channels=channels, **values)["below"][0]
    finally:
        file.unlink()


@pytest.mark.parametrize(("channels", "most"), [(8, 15e-3), (16, 30e-3)])
def test_an_open_sink_feeds_u41_less_than_its_pin_may_carry(channels, most):
    """50 mA; with the 1 kohm that were there before it was 80 with 16 channels."""
    assert 0.5 * most < results.fed(channels) < most


@pytest.mark.parametrize("contact", [0.05, 20])
def test_16_amplifiers_on_one_line_settle_in_time(contact):
    for cut in ("1m", "1g"):
        assert results.switching("mended", contact=contact, cut=cut)["settling"] < 120e-6


@pytest.mark.parametrize(("high", "low"), [(BROKEN, SOUND), (SOUND, BROKEN)])
def test_one_stuck_transistor_drives_nothing_while_all_is_off(high, low):
    assert run("stuck", variant="mended", on=OFF, high=high, low=low)["skin"][0] < 1e-7
    driven = run("stuck", variant="mended", on=ON, high=high, low=low)["skin"][0]
    assert driven == pytest.approx(results.AMPERES, rel=0.01)


def test_in_the_sources_circuit_a_stuck_low_side_keeps_the_current_on():
    said = run("stuck", variant="source", on=OFF, high=SOUND, low=BROKEN)
    assert said["skin"][0] == pytest.approx(results.AMPERES, rel=0.01)


@pytest.mark.parametrize("body", ["100", "1k"])
def test_the_option_for_the_body_stays_within_the_standard(body):
    said = run("body", driven=1, fault_volts=0, fault_resistance="1g", body=body)
    assert said["rms"][0] == pytest.approx(1e-3, rel=0.01)
    assert said["weighted"][0] < 100e-6  # type BF, normal condition, alternating
    assert said["direct"][0] < 10e-6  # and direct


@pytest.mark.parametrize("volts", ["5", "pulse(-5 5 0 10n 10n 10u 20u)"])
def test_one_fault_in_it_too(volts):
    said = run("body", driven=0, fault_volts=volts, fault_resistance=1, body="1k")
    assert said["weighted"][0] < 500e-6
    assert said["direct"][0] < 50e-6


def test_one_amplifier_for_all_would_settle_anew_for_each_electrode():
    """The cheaper board that docs/hardware.md rejects."""
    said = results.shared()
    assert 50e-6 < said["settling"] < 100e-6
    assert said["last"] == pytest.approx(2.5 + 1, rel=1e-3)


def test_the_twins_figures_are_those_of_the_decks():
    text = results.FILE.read_text(encoding="utf-8")
    assert text == results.written(results.measured(), text)


def test_a_deck_without_its_values_is_refused():
    with pytest.raises(DeckError, match="expected values for"):
        run("compliance", variant="mended")
    with pytest.raises(DeckError, match="compliance"):
        run("compliance", variant="nobody", loads="1", amps=0.1)


def test_the_decks_have_the_layouts_resistance_and_capacitance():
    assert parasitics.FILE.read_text(encoding="utf-8") == parasitics.written()
