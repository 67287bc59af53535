"""The schematics of the KiCad projects: pins, rest states, reference, parts to order."""

import tomllib
from collections import Counter

import pytest

import bill
import netlist
import pins
from circuit import ROOT, Circuit

HEADERS = {
    "J61": {5: "5V", 6: "GND", 7: "GND"},
    "J62": {n + 1: f"A{n}" for n in range(8)},
    "J63": {n + 1: f"A{n + 8}" for n in range(8)},
    "J64": {1: "GND", 2: "GND", 35: "5V", 36: "5V"},
}
"""The Arduino Mega 2560's names of the headers' pins."""
# The double row: D52 and D53 beside pins 3 and 4, down to D22 and D23 beside 33 and 34.
for _row in range(16):
    HEADERS["J64"] |= {3 + 2 * _row: f"D{52 - 2 * _row}", 4 + 2 * _row: f"D{53 - 2 * _row}"}


@pytest.fixture(scope="module", params=["board-8", "board-16"])
def circuit(request):
    return Circuit.read(request.param)


def test_the_headers_are_those_of_the_pin_table(circuit):
    table = pins.signals(pins.read(pins.TABLE.read_text(encoding="utf-8")))
    on = {
        HEADERS[reference][int(pin)]: net
        for (reference, pin), net in circuit.net_of.items()
        if reference in HEADERS and int(pin) in HEADERS[reference]
    }
    for signal, pin in table.items():
        wanted = "LATCH" if signal == "LATCH_0" else signal
        assert on[pins.arduino(pin)].rsplit("/", 1)[-1] == wanted
    assert on["GND"] == "GND"
    assert on["5V"] == "+5V"


def test_each_gate_rests_at_a_rail(circuit):
    held = {frozenset(nets) for nets in circuit.between("R")}
    for number in range(1, circuit.channels + 1):
        high, low = (circuit.net_of[f"Q{number}0{n}", "1"] for n in (2, 3))
        shift = circuit.net_of[f"Q{number}01", "1"]
        assert {high, "+12V"} in held
        assert {low, "GND"} in held
        assert {shift, "GND"} in held


def test_every_control_line_has_a_pull_down(circuit):
    held = {frozenset(nets) for nets in circuit.between("R")}
    for (reference, pin), net in circuit.net_of.items():
        name = HEADERS.get(reference, {}).get(int(pin) if pin.isdigit() else 0, "")
        if name.startswith("D") and not net.startswith("unconnected"):
            assert {net, "GND"} in held, net


def test_12_v_come_only_with_5_v(circuit):
    """All +12V goes through Q1, its source towards the jack, and -5V has a diode to ground."""
    net = circuit.net_of
    assert {net[pin] for pin in (("F1", "2"), ("D1", "1"), ("Q1", "2"))} == {"/Supply/INPUT"}
    assert {reference for reference, _ in circuit.nets["/Supply/INPUT"]} == {
        *("F1", "D1", "C1", "TP1", "Q1", "R2", "C6")
    }
    assert (net["Q1", "3"], net["Q2", "2"], net["R4", "1"]) == ("+12V", "GND", "+5V")
    assert [net["D2", pin] for pin in "132"] == ["-5V", "-5V", "GND"]


def test_12_v_without_their_supply_stay_near_ground(circuit):
    """The amplifiers draw +12V down where USB alone is there: D3 from ground, one diode of it."""
    assert [circuit.net_of["D3", pin] for pin in "123"] == ["GND", "+12V", "+12V"]
    assert circuit.parts["D3"].value == "BAT54S"


def test_a_tap_is_behind_what_limits_u41(circuit):
    taps = {circuit.parts[f"R{n}06"].value for n in range(1, circuit.channels + 1)}
    assert taps == {"3.3k"}


def test_an_amplifier_reads_against_the_electrode_before_the_sink(circuit):
    inputs = [9, 8, 7, 6, 5, 4, 3, 2, 23, 22, 21, 20, 19, 18, 17, 16]
    for sink in range(16):
        wanted = f"/TAP_{(sink - 1) % circuit.channels}" if sink < circuit.channels else "GND"
        assert circuit.net_of["U41", str(inputs[sink])] == wanted


def test_the_clamp_behind_10_kohm_leaks_little(circuit):
    clamps = {circuit.parts[f"D{n}02"].value for n in range(1, circuit.channels + 1)}
    assert clamps == {"BAV199"}


def test_the_dump_closes_at_once_and_opens_late(circuit):
    """The diode lets the gate of the dump's transistor rise at once: its cathode is at the gate."""
    assert circuit.net_of["D21", "1"] == circuit.net_of["Q22", "1"]
    assert circuit.net_of["D21", "2"] == circuit.net_of["U23", "4"]


def test_every_channel_is_the_same(circuit):
    """Parts of channel n are those of channel 1, with the same values and numbers to order."""

    def of(number):
        named = circuit.parts.values()
        mine = [p for p in named if p.reference.lstrip("CDJQRU").startswith(str(number))]
        return Counter(
            (p.value, p.footprint, p.fields.get("MPN"))
            for p in mine
            if len(p.reference.lstrip("CDJQRU")) == len(str(number)) + 2
        )

    assert all(of(number) == of(1) for number in range(2, circuit.channels + 1))
    assert sum(of(1).values()) == 26


def test_what_is_ordered_has_numbers_and_a_price(circuit):
    groups = bill.grouped(circuit.parts)
    assert sum(map(len, groups.values())) == sum(part.in_bom for part in circuit.parts.values())
    assert set(groups) <= set(bill.known())
    one, ten, hundred = (bill.total(circuit.parts, boards) for boards in bill.BOARDS)
    assert one > ten > hundred > 50


def test_what_is_known_of_parts_is_dated_and_in_production():
    table = tomllib.loads(bill.PARTS.read_text(encoding="utf-8"))
    assert str(table["checked"]["date"]) > "2026"
    known = bill.known().values()
    assert {part.state for part in known} == {"active", "old"}
    assert all(part.each[0] >= part.each[1] >= part.each[2] > 0 for part in known)
    assert sum(bool(part.second) for part in known) >= 25


def test_the_committed_bill_is_that_of_the_netlist(circuit):
    committed = (ROOT / f"{circuit.board}.csv").read_text(encoding="utf-8")
    assert committed == bill.bill(circuit.parts)


def test_a_part_without_a_number_is_refused(circuit):
    part = circuit.parts["U101"]
    broken = circuit.parts | {
        "U101": netlist.Part(part.reference, part.value, part.footprint, part.path, {}, True)
    }
    with pytest.raises(bill.BillError, match=r"U101 \(INA118\): expected a field Manufacturer"):
        bill.bill(broken)


def test_a_netlist_reads_back(circuit):
    assert netlist.parse(netlist.written(circuit.parts, circuit.nets)) == (
        circuit.parts,
        circuit.nets,
    )
