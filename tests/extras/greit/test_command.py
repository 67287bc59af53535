"""``tomoskin skin merit``."""

import csv
import json

import pytest

SKIN = "textile-disc-8"


def test_a_row_for_each_target(tomoskin, tmp_path):
    table = tmp_path / "merit.csv"
    code, out, err = tomoskin("skin", "merit", SKIN, "--out", table)
    assert (code, err) == (0, "")
    assert out.startswith("noser: noise figure")
    assert len(out.splitlines()) == 12
    with table.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert float(rows[0]["distance_m"]) == pytest.approx(0.0, abs=1e-3)
    assert float(rows[-1]["distance_m"]) == pytest.approx(0.09, abs=2e-3)


def test_for_programs_with_a_trained_operator_beside_it(tomoskin):
    code, out, _ = tomoskin("skin", "merit", SKIN, "--greit", "1.2", "--towards", "3", "--json")
    found = json.loads(out)
    assert code == 0
    assert set(found) == {"noser", "greit"}
    assert found["greit"]["noise_figure"] == pytest.approx(1.2, rel=0.1)


def test_a_picture(tomoskin, tmp_path):
    pytest.importorskip("matplotlib")
    assert tomoskin("skin", "merit", SKIN, "--out", tmp_path / "merit.png")[0] == 0
    assert (tmp_path / "merit.png").stat().st_size > 10_000


def test_wrong_usage(tomoskin):
    for options in (("--towards", "9"), ("--towards", "0"), ("--out", "merit.gif")):
        code, _, err = tomoskin("skin", "merit", SKIN, *options)
        assert code == 2
        assert "Traceback" not in err


def test_a_noise_figure_that_cannot_be(tomoskin):
    code, _, err = tomoskin("skin", "merit", SKIN, "--greit", "0.001")
    assert code == 1
    assert "expected a noise figure from" in err
