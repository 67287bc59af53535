"""``tomoskin skin``."""

import json

import pytest

from tomoskin.model.skin import Skin


def test_list(tomoskin):
    code, out, _ = tomoskin("skin", "list")
    assert code == 0
    for name in (
        "textile-disc-8",
        "textile-disc-16",
        "textile-disc-32",
        "textile-square-16",
    ):
        assert name in out


def test_list_for_programs(tomoskin):
    code, out, _ = tomoskin("skin", "list", "--json")
    assert code == 0
    found = {skin["name"]: skin for skin in json.loads(out)}
    assert set(found) == set(Skin.names())
    assert found["textile-disc-8"]["n_measurements"] == 40


def test_what_show_prints_is_a_skin_file_of_that_skin(tomoskin, tmp_path):
    code, out, _ = tomoskin("skin", "show", "textile-square-16")
    assert code == 0
    (tmp_path / "again.toml").write_text(out)
    again = Skin.load(tmp_path / "again.toml")
    assert again.identity == Skin.load("textile-square-16").identity
    _, out, _ = tomoskin("skin", "show", str(tmp_path / "again.toml"), "--json")
    assert json.loads(out)["identity"] == again.identity


def test_show_leaves_out_what_has_no_effect_unless_a_person_has_set_it(tomoskin, tmp_path):
    own = Skin.load("textile-disc-8").altered({"touch": {"gamma2": 0.8}})
    (tmp_path / "own.toml").write_text(own.to_toml())
    _, out, _ = tomoskin("skin", "show", tmp_path / "own.toml")
    assert 'prior = "noser"' in out
    assert "coupling" not in out  # of another prior
    assert "gamma1" not in out  # of another method
    assert "gamma2 = 0.8" in out
    assert Skin.load(tmp_path / "own.toml").document == own.document


def test_check(tomoskin):
    code, out, _ = tomoskin("skin", "check", "textile-disc-8")
    assert code == 0
    assert "ok" in out
    _, out, _ = tomoskin("skin", "check", "textile-disc-8", "--json")
    assert json.loads(out)["mesh"]["quality_minimum"] > 0.3


@pytest.mark.parametrize("prior", ["gaussian", "laplace"])
def test_a_prior_under_which_regions_lie_too_far_out_is_said(tomoskin, tmp_path, prior):
    changes = {"inverse": {"prior": prior}, "touch": {"method": "image"}}
    skin = Skin.load("textile-disc-8").altered(changes)
    file = tmp_path / "own.toml"
    file.write_text(skin.to_toml())
    code, _, errors = tomoskin("skin", "check", file)
    assert code == 0
    assert f'images under prior "{prior}" are smooth up to the rim' in errors
    file.write_text(skin.altered({"touch": {"method": "fit"}}).to_toml())
    assert "smooth" not in tomoskin("skin", "check", file)[2]
    file.write_text(skin.altered({"inverse": {"prior": "noser"}}).to_toml())
    assert "smooth" not in tomoskin("skin", "check", file)[2]


def test_a_wrong_file_is_one_sentence(tomoskin, tmp_path):
    text = Skin.load("textile-disc-8").to_toml().replace("[mesh]\ncells", "[mesh]\nceils")
    file = tmp_path / "wrong.toml"
    file.write_text(text)
    code, out, errors = tomoskin("skin", "check", str(file))
    assert code == 1
    assert out == ""
    assert len(errors.splitlines()) == 1
    for part in ("wrong.toml", "mesh", "ceils"):
        assert part in errors


def test_usage(tomoskin):
    assert tomoskin("skin", "paint")[0] == 2
    assert tomoskin("skin", "check")[0] == 2


def test_a_skin_that_saturates_its_board_is_no_good_skin(tomoskin, tmp_path):
    file = tmp_path / "saturated.toml"
    skin = Skin.load("textile-disc-8").altered({"material": {"sheet_resistance": "800 ohm/sq"}})
    file.write_text(skin.to_toml())
    code, out, errors = tomoskin("skin", "check", str(file))
    assert (code, out) == (1, "")
    for part in ("saturated.toml", "supply: 10.8 V", "a current of 0.12 mA fits", "gain"):
        assert part in errors
    code, out, errors = tomoskin("design", "--skin", str(file), "--electrodes", "")
    assert (code, out) == (1, "")
    assert "a current of 0.11 mA fits" in errors


def test_check_says_which_places_the_pattern_cannot_tell_apart(tomoskin, tmp_path):
    rows = [(k, j) for k in range(4) for j in range(4) if j != k]
    drive = {"pattern": None, "current": "40 mA"}
    drive |= {"drive": [[k + 4, k] for k, _ in rows], "measure": [[j, j + 4] for _, j in rows]}
    skin = Skin.load("textile-disc-8").altered({"drive": drive, "readout": {"gain": 15}})
    (tmp_path / "across.toml").write_text(skin.to_toml())
    code, out, err = tomoskin("skin", "check", tmp_path / "across.toml", "--json")
    assert code == 0
    said = json.loads(out)["ambiguity"]
    assert "turned by 180° about the centre, give the same voltages" in said
    assert 'pattern = "opposite" in [drive] separates them' in said
    assert said in err
    assert json.loads(tomoskin("skin", "check", "textile-disc-8", "--json")[1])["ambiguity"] is None
