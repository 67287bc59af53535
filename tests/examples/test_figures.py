"""Every example makes its figure, and its checks pass on the twin and fail on wrong data."""

from __future__ import annotations

import math
import struct

import numpy as np
import pytest

from tomoskin.core import DataError, WallClock
from tomoskin.twin import TwinSettings, make_twin

pytest.importorskip("tomoskin.extras.greit", reason="it uses an extra that is not here")

MEASURED = [
    "fig52_potentials",
    "fig54_reference",
    "fig55_indentation",
    "fig57_probe_sizes",
    "fig58_single_press",
    "fig59_four_probes",
    "fig510_three_presses",
    "fig511_cylinders",
    "fig512_curved",
    "patterns_and_priors",
]


@pytest.mark.parametrize("name", [*MEASURED, "fig31_mesh"])
def test_the_figure_is_made_and_the_numbers_are_those_of_the_gallery(ran, published, name):
    run = ran(name)
    assert run.found.keys() == published[name].values.keys()
    assert published[name].broken(run.found) == []
    assert all(math.isfinite(value) for value in run.found.values())
    data = run.figure.read_bytes()
    assert data.startswith(b"\x89PNG")
    width, height = struct.unpack(">II", data[16:24])
    assert width > 400
    assert height > 250


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2, 7))
@pytest.mark.parametrize("name", MEASURED)
def test_the_numbers_hold_on_other_twins(imported, name, seed, tmp_path):
    assert imported(name).main(["--seed", str(seed), "--out", str(tmp_path)])


def test_a_potential_beyond_the_converter_is_no_measurement(imported, tmp_path):
    """A press near the rim lifts the driven channels: the reason for a gain of 30, not 35."""
    example, lab = imported("patterns_and_priors"), imported("lab")
    high = {**example.ALL_ROWS, "readout": {"gain": 40}}
    said = r"at the rail: E\d stands at the converter's upper rail.*lower the amplifier's gain"
    with (
        lab.open_lab("none", ["--out", str(tmp_path)], "", high) as bench,
        pytest.raises(DataError, match=said),
    ):
        bench.measure("at the rail")


@pytest.mark.slow
@pytest.mark.parametrize("name", MEASURED)
def test_a_recording_gives_the_same_numbers(ran, name, tmp_path):
    run = ran(name)
    again = run.module.main(["--source", f"replay:{run.recording}", "--out", str(tmp_path)])
    assert len(again) > 1
    assert again.items() <= run.found.items()  # a recording holds nothing of other twins


@pytest.mark.slow
@pytest.mark.parametrize("name", MEASURED)
def test_the_checks_fail_on_rows_in_a_wrong_order(ran, imported, name, monkeypatch, tmp_path):
    run = ran(name)
    lab = imported("lab")
    measure = lab.Lab.measure

    def shuffled(self, stage, *probes, n=lab.FRAMES):
        volts = measure(self, stage, *probes, n=n)
        return volts[:, np.random.default_rng(0).permutation(volts.shape[1])]

    monkeypatch.setattr(lab.Lab, "measure", shuffled)
    with pytest.raises(AssertionError):
        run.module.main(["--source", f"replay:{run.recording}", "--out", str(tmp_path)])


@pytest.mark.slow
@pytest.mark.parametrize("name", [n for n in MEASURED if n not in MEASURED[:2]])
def test_the_checks_fail_where_nothing_is_pressed(ran, imported, name, monkeypatch, tmp_path):
    run = ran(name)
    lab = imported("lab")
    monkeypatch.setattr(lab, "_pressed", lambda twin, _, press=lab._pressed: press(twin, ()))
    with pytest.raises(AssertionError):
        run.module.main(["--out", str(tmp_path)])


@pytest.mark.slow
def test_the_mesh_check_fails_on_another_mesh(imported, tmp_path):
    with pytest.raises(AssertionError, match="triangles"):
        imported("fig31_mesh").main(["--skin", "textile-disc-16", "--out", str(tmp_path)])


def test_the_gain_is_printed_and_may_be_another(imported, tmp_path, capsys):
    example = imported("fig55_indentation")
    example.main(["--out", str(tmp_path)])
    usual = capsys.readouterr().err
    example.main(["--out", str(tmp_path), "--force", "--gain", "30"])
    assert "amplifier gain 35" in usual
    assert "amplifier gain 30" in capsys.readouterr().err


def test_a_person_at_a_board_is_told_what_to_do(imported, monkeypatch, tmp_path):
    lab, example = imported("lab"), imported("fig55_indentation")
    asked = []

    def opened(spec, skin):
        assert spec == "serial:of-the-lab"
        twin = make_twin(skin, TwinSettings(), WallClock(), pace=0.0)
        real = []

        def answer(prompt):
            asked.append(prompt)
            x, y = lab.in_front_of(skin, 1 if len(asked) < 3 else 6, 22.5e-3)
            real[:] = [] if "nothing" in prompt else [lab.Probe(example.Circle(15e-3), x, y, 3.0)]
            twin.set_presses(tuple(real))
            return ""

        monkeypatch.setattr("builtins.input", answer)
        return twin

    monkeypatch.setattr(lab, "open_source", opened)
    monkeypatch.setattr(lab, "REST", 0.0)
    found = example.main(["--source", "serial:of-the-lab", "--out", str(tmp_path)])
    assert found["E2 mean of its pairs, V"] < 0
    assert [prompt.split(".")[0] for prompt in asked] == [
        "Now: nothing touches the skin (before E2)",
        "Now: 15 mm probe, 3 N, 7",
        "Now: nothing touches the skin (before E7)",
        "Now: 15 mm probe, 3 N, 7",
    ]


def test_a_recording_of_another_experiment_is_refused(ran, imported, tmp_path):
    other = ran("fig54_reference").recording
    with pytest.raises(DataError, match="holds no 10 frames of"):
        imported("fig57_probe_sizes").main(["--source", f"replay:{other}", "--out", str(tmp_path)])


def test_a_recording_of_another_scan_is_refused(ran, imported, tmp_path):
    other = ran("fig58_single_press").recording
    with pytest.raises(DataError, match="scan"):
        imported("fig54_reference").main(["--source", f"replay:{other}", "--out", str(tmp_path)])


def test_a_figure_is_written_over_only_when_that_is_said(imported, tmp_path, monkeypatch, capsys):
    example, mine = imported("fig31_mesh"), tmp_path / "fig31_mesh.png"
    mine.write_bytes(b"mine")
    with monkeypatch.context() as patch:
        patch.setattr(example, "discretisation_error", lambda *_: pytest.fail("it has begun"))
        for more in ((), ("--record", str(tmp_path / "frames.npz"), "--force")):
            with pytest.raises(SystemExit) as end:
                example.main(["--out", str(tmp_path), *more])
            assert end.value.code == 2
    said = capsys.readouterr().err
    assert "exists already (choose another name, or overwrite it: --force)" in said
    assert "expected a name that ends in .mcap (a recording), got frames.npz" in said
    assert mine.read_bytes() == b"mine"
    example.main(["--out", str(tmp_path), "--force"])
    assert mine.read_bytes().startswith(b"\x89PNG")
