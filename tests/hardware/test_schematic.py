"""The schematic: rule check, connector, netlist and bill of materials that are not stale."""

import csv

import pytest

import generate
import pins
from schematic import parts
from schematic.board import assembly, channel, supplies
from schematic.circuit import Circuit


@pytest.mark.parametrize("channels", [8, 16])
def test_the_rule_check_finds_nothing(channels):
    assert assembly(channels).problems() == []


def test_what_is_committed_is_not_stale():
    assert generate.stale() == []


def test_the_rule_check_finds_what_is_wrong():
    circuit = Circuit()
    supplies(circuit)
    circuit.add(parts.NFET, "FLOATS GND FLOATS")  # a gate that nothing holds
    circuit.add(parts.FOLLOWER, "2V5 GND FLOATS NOWHERE +3V")  # a second output, no supply
    odd = circuit.add(parts.PRECISE, "2V5 GND", "12.25")
    said = "\n".join(circuit.problems())
    for problem in (
        "2V5: two outputs",
        "FLOATS: a gate that no resistor holds",
        "NOWHERE: only",
        "+3V: supplied by nothing",
        f"{odd}: 12.25 is no stock value",
    ):
        assert problem in said


@pytest.mark.parametrize("net", ["SHIFT_0", "LOW_0", "HIGH_0"])
def test_each_gate_of_a_channel_rests_off(net):
    circuit = Circuit()
    channel(circuit, 0)
    held = [
        r
        for r, p in circuit.placed.items()
        if set(p.nets.values()) in ({net, "GND"}, {net, "+12V"})
    ]
    assert len(held) == 1
    del circuit.placed[held[0]]
    assert f"{net}: a gate that no resistor holds" in circuit.problems()


def test_every_enable_has_a_pull_down():
    circuit = assembly(16)
    for signal in ("SOURCE_ENABLE_0", "SOURCE_ENABLE_1", "SINK_ENABLE_0", "SINK_ENABLE_1"):
        assert any(
            placed.part is parts.R and set(placed.nets.values()) == {signal, "GND"}
            for placed in circuit.placed.values()
        )


def test_the_connector_is_that_of_the_pin_table():
    table = pins.signals(pins.read(pins.TABLE.read_text(encoding="utf-8")))
    mega = next(p for p in assembly(16).placed.values() if p.part.name == "Arduino Mega 2560")
    for signal, pin in table.items():
        assert mega.nets[signal] == signal
        assert mega.part.numbers[signal] == pins.arduino(pin)


@pytest.mark.parametrize("channels", [8, 16])
def test_an_amplifier_reads_against_the_electrode_before_the_sink(channels):
    mux = next(p for p in assembly(channels).placed.values() if p.part is parts.MUX)
    for sink in range(channels):
        assert mux.nets[f"I{sink}"] == f"TAP_{(sink - 1) % channels}"


@pytest.mark.parametrize(("channels", "least", "most"), [(8, 80, 200), (16, 150, 350)])
def test_the_bill_adds_up(channels, least, most):
    text = (generate.ROOT / f"board-{channels}.csv").read_text(encoding="utf-8")
    *rows, total = csv.DictReader(text.splitlines())
    assert sum(int(row["number"]) for row in rows) == int(total["number"])
    assert least < float(total["euros"]) < most
    assert float(total["euros"]) == pytest.approx(sum(float(r["euros"]) for r in rows), abs=1)


def test_the_netlist_has_each_part_once():
    circuit = assembly(8)
    text = circuit.netlist()
    assert text.count("(comp ") == len(circuit.placed)
    assert text.count("(") == text.count(")")
