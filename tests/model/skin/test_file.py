"""Skin files: what is read, and what each kind of bad file is told."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tomoskin.core import SkinError
from tomoskin.model.mesh import Disc, Ellipse, Polygon, Rectangle
from tomoskin.model.pattern import Pattern
from tomoskin.model.skin import Skin

FILE = """
format = 1
[skin]
name = "mine"
[outline]
shape = "disc"
diameter = "20 cm"
[electrodes]
count = 8
width = "10 mm"
contact_impedance = "0.2 mohm*m"
[material]
sheet_resistance = "0.8 ohm/sq"
[drive]
current = "100 mA"
"""

SQUARE = """shape = "polygon"
vertices = [["0 mm", "0 mm"], ["10 cm", "0 mm"], ["10 cm", "10 cm"], ["0 mm", "10 cm"]]"""
PLACES = """positions = [["50 mm", "0 mm"], ["100 mm", "50 mm"], ["50 mm", "99.5 mm"],
  ["0 mm", "50 mm"]]"""


def changed(old: str, new: str, text: str = FILE) -> str:
    assert old in text
    return text.replace(old, new)


def failure(text: str) -> SkinError:
    with pytest.raises(SkinError) as caught:
        Skin.from_toml(text, source="my.toml")
    return caught.value


def test_defaults_are_filled_in() -> None:
    skin = Skin.from_toml(FILE)
    assert skin.outline == Disc(0.1)
    assert skin.pattern().identity == Pattern.adjacent(8).identity
    assert skin.mesh_cells == 1500
    assert skin.inverse.prior == "noser"
    assert skin.electrode_centres[0] == pytest.approx([0, 0.1], abs=1e-12)


def test_ellipse_and_rectangle() -> None:
    sides = 'width = "200 mm"\nheight = "100 mm"'
    ellipse = changed('shape = "disc"\ndiameter = "20 cm"', f'shape = "ellipse"\n{sides}')
    assert Skin.from_toml(ellipse).outline == Ellipse(0.1, 0.05)
    sheet = Skin.from_toml(ellipse.replace("ellipse", "rectangle")).outline
    assert isinstance(sheet, Rectangle)
    assert np.ptp(sheet.vertices, axis=0).tolist() == pytest.approx([0.2, 0.1])


def test_polygon_with_electrodes_one_by_one() -> None:
    text = changed('shape = "disc"\ndiameter = "20 cm"', SQUARE)
    skin = Skin.from_toml(changed("count = 8", PLACES, text))
    assert isinstance(skin.outline, Polygon)
    expected = np.array([(50, 0), (100, 50), (50, 100), (0, 50)]) / 1e3
    assert skin.electrode_centres == pytest.approx(expected, abs=1e-12)
    assert len(skin.mesh().electrodes) == 4


def test_counter_clockwise_from_another_direction() -> None:
    text = changed("count = 8", 'count = 4\nfirst = "0 deg"\norder = "counter-clockwise"')
    centres = Skin.from_toml(text).electrode_centres
    assert centres == pytest.approx(np.array([(1, 0), (0, 1), (-1, 0), (0, -1)]) * 0.1, abs=1e-12)


def test_impedance_of_each_electrode() -> None:
    each = ", ".join(f'"{k} ohm*m"' for k in range(1, 9))
    skin = Skin.from_toml(changed('"0.2 mohm*m"', f"[{each}]"))
    assert skin.contact_impedance == pytest.approx(np.arange(1.0, 9.0))


def test_tables_of_ones_own() -> None:
    tables = "drive = [[1, 0], [2, 1]]\nmeasure = [[2, 3], [3, 4]]\n"
    skin = Skin.from_toml(FILE + tables)
    assert skin.pattern().drive.tolist() == [[1, 0], [2, 1]]
    assert skin.pattern().measure.tolist() == [[2, 3], [3, 4]]
    assert skin.pattern().n_electrodes == 8


def test_named_patterns() -> None:
    skin = Skin.from_toml(FILE + 'pattern = "adjacent+opposite"\n')
    assert skin.pattern().n_drive == 12


def test_arrays_of_a_skin_are_frozen() -> None:
    skin = Skin.load("textile-disc-8")
    with pytest.raises(AttributeError):
        skin.current = 1.0  # type: ignore[misc]


BAD = {
    "name that is empty": ('"mine"', '" "', "[skin] name", "text of 1 to 255 characters"),
    "name of two lines": ('"mine"', r'"mi\nne"', "[skin] name", "on one line"),
    "name without end": ('"mine"', f'"{"x" * 256}"', "[skin] name", "text of 1 to 255 characters"),
    "unknown section": ("[drive]", "[drives]", ": unknown", 'did you mean "drive"'),
    "unknown key": ("count =", "counts =", "[electrodes]: unknown", 'did you mean "count"'),
    "unknown top key": ("format = 1", "format = 1\nx = 1", "", 'unknown section "x"'),
    "section that is a value": (
        '[skin]\nname = "mine"\n',
        "skin = 1\n",
        "[skin]",
        "expected a section",
    ),
    "no format": ("format = 1", "", "format", "is missing"),
    "other format": ("format = 1", "format = 2", "format", "expected 1, got 2"),
    "format of another type": ("format = 1", "format = true", "format", "got true"),
    "missing key": ("count = 8", "", "[electrodes] count", "a whole number from 4 to 32"),
    "missing section": (
        '[material]\nsheet_resistance = "0.8 ohm/sq"',
        "",
        "[material] sheet_resistance",
        "is missing",
    ),
    "missing diameter": (
        'diameter = "20 cm"',
        "",
        "[outline] diameter",
        "a length from 1 to 5000 mm",
    ),
    "key of another shape": (
        'diameter = "20 cm"',
        'diameter = "20 cm"\nwidth = "1 cm"',
        "[outline] width",
        'needs shape = "ellipse" or "rectangle", got shape = "disc"',
    ),
    "unknown shape": ('"disc"', '"disk"', "[outline] shape", 'got "disk"; did you mean "disc"?'),
    "value left out": ('"20 cm"', "", "", "is not valid TOML near [outline] diameter: "),
    "quote left out": ('"20 cm"', '"20 cm', "", "is not valid TOML near [outline] diameter: "),
    "bare number": ('"20 cm"', "200", "[outline] diameter", 'write it as "200 mm"'),
    "boolean": ('"20 cm"', "true", "[outline] diameter", "got true"),
    "wrong unit": ('"20 cm"', '"20 s"', "[outline] diameter", 'got unit "s"'),
    "no number": ('"20 cm"', '"wide"', "[outline] diameter", "expected a number with a unit"),
    "text for no unit": ('"20 cm"', '"200"', "[outline] diameter", "no unit"),
    "zero size": ('"20 cm"', '"0 mm"', "[outline] diameter", "from 1 to 5000 mm"),
    "negative size": ('"20 cm"', '"-20 cm"', "[outline] diameter", "from 1 to 5000 mm"),
    "huge size": ('"20 cm"', '"20 m"', "[outline] diameter", 'got "20 m"'),
    "count as text": ("count = 8", 'count = "8"', "[electrodes] count", 'got "8"'),
    "count with a fraction": ("count = 8", "count = 8.0", "[electrodes] count", "got 8.0"),
    "count as boolean": ("count = 8", "count = true", "[electrodes] count", "got true"),
    "too many electrodes": ("count = 8", "count = 33", "[electrodes] count", "got 33"),
    "overlap": ('"10 mm"', '"80 mm"', "[electrodes], E2", "overlaps E1"),
    "no gap": ("count = 8", "count = 32", "[electrodes]", "overlaps"),
    "list of wrong length": (
        '"0.2 mohm*m"',
        '["1 ohm*m", "2 ohm*m"]',
        "[electrodes] contact_impedance",
        "expected one value or 8",
    ),
    "wrong entry of a list": (
        '"0.2 mohm*m"',
        '["1 ohm*m", "2 ohm"]',
        "[electrodes] contact_impedance",
        "entry 1: expected a unit of resistivity",
    ),
    "impedance of zero": ('"0.2 mohm*m"', '"0 ohm*m"', "contact_impedance", "from 1e-09"),
    "name is no text": ('"mine"', "5", "[skin] name", "on one line, got 5"),
    "current": ('"100 mA"', '"5 A"', "[drive] current", "from 0.001 to 1000 mA"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_values_name_the_place(case: str) -> None:
    old, new, place, message = BAD[case]
    text = changed(old, new)
    if case == "no gap":
        text = changed('"10 mm"', '"20 mm"', text)
    error = failure(text)
    assert str(error).startswith("my.toml")
    assert place in str(error)
    assert message in str(error)


ADDED = {
    "NaN": ("[inverse]\nalpha = nan", "[inverse] alpha", "got nan"),
    "infinite": ("[inverse]\nalpha = inf", "[inverse] alpha", "got inf"),
    "alpha as text": ('[inverse]\nalpha = "1"', "[inverse] alpha", 'got "1"'),
    "alpha of zero": ("[inverse]\nalpha = 0", "[inverse] alpha", "a number from 1e-09"),
    "unknown prior": ('[inverse]\nprior = "tv"', "[inverse] prior", 'or "matern", got "tv"'),
    "unknown pattern": ('pattern = "adjacnt"', "[drive]", '"adjacnt"; did you mean "adjacent"?'),
    "pattern that cannot be": ('pattern = "skip:9"', "[drive]", "expected k from 0 to 6"),
    "pattern and tables": (
        'pattern = "adjacent"\ndrive = [[1, 0]]\nmeasure = [[2, 3]]',
        "[drive] pattern",
        "cannot be combined with drive",
    ),
    "drive alone": ("drive = [[1, 0]]", "[drive] drive", "needs the key measure"),
    "measure alone": ("measure = [[1, 0]]", "[drive] measure", "needs the key drive"),
    "tables of unequal length": (
        "drive = [[1, 0]]\nmeasure = [[2, 3], [3, 4]]",
        "[drive]",
        "as many drive rows",
    ),
    "electrode that is not there": (
        "drive = [[1, 9]]\nmeasure = [[2, 3]]",
        "[drive], drive row 0",
        "electrodes from 0 (E1) to 7",
    ),
    "source is sink": ("drive = [[1, 1]]\nmeasure = [[2, 3]]", "[drive]", "are both E2"),
    "row of three": (
        "drive = [[1, 0, 2]]\nmeasure = [[2, 3]]",
        "[drive] drive",
        "row 0: expected a pair [source, sink], each a whole number from 0 to 31, got [1, 0, 2]",
    ),
    "row of text": (
        'drive = [["E1", 0]]\nmeasure = [[2, 3]]',
        "[drive] drive",
        "row 0, source: expected a whole number",
    ),
    "empty table": ("drive = []\nmeasure = []", "[drive] drive", "at least 1 pairs"),
    "no table": ("drive = 3\nmeasure = []", "[drive] drive", "got 3"),
    "sum too large": (
        "[readout]\nadc_bits = 16\noversampling = 2",
        "[readout] oversampling",
        "expected at most 1 at 16 bits, got 2",
    ),
    "section twice": ("[skin]", "", "is not valid TOML"),
    "unknown word": ('[inverse]\nprior = "nosr"', "[inverse] prior", 'did you mean "noser"?'),
}


@pytest.mark.parametrize("case", ADDED)
def test_bad_additions_name_the_place(case: str) -> None:
    added, place, message = ADDED[case]
    error = failure(FILE + added)
    assert str(error).startswith("my.toml")
    assert place in str(error)
    assert message in str(error)


@pytest.mark.parametrize(
    ("vertices", "message"),
    [
        ('[["0 mm","0 mm"],["1 cm","1 cm"],["1 cm","0 mm"],["0 mm","1 cm"]]', "meets"),
        ('[["0 mm","0 mm"],["1 cm","1 cm"],["2 cm","2 cm"]]', "no area"),
        ('[["0 mm","0 mm"],["1 cm","1 cm"]]', "at least 3 pairs"),
        ('[["0 mm","0 mm"],["1 cm",1],["2 cm","2 cm"]]', "row 1, y: expected a length"),
        ('[["0 mm","0 mm"],["1 cm","0 mm"],["0 mm","1 cm"],["0 cm","0 mm"]]', "repeats vertex 0"),
    ],
)
def test_polygons_that_cannot_be(vertices: str, message: str) -> None:
    text = changed('"disc"\ndiameter = "20 cm"', f'"polygon"\nvertices = {vertices}')
    error = failure(text)
    assert "[outline]" in error.where
    assert message in str(error)


def test_position_off_the_rim_names_the_electrode() -> None:
    text = changed('shape = "disc"\ndiameter = "20 cm"', SQUARE)
    text = changed("count = 8", changed('"99.5 mm"', '"80 mm"', PLACES), text)
    error = failure(text)
    assert "E3" in error.where
    assert "(50, 80) mm, 20 mm off" in error.message


@pytest.mark.parametrize("beside", ["count = 8", 'first = "0 deg"', 'order = "clockwise"'])
def test_positions_stand_alone(beside: str) -> None:
    text = changed('shape = "disc"\ndiameter = "20 cm"', SQUARE)
    error = failure(changed("count = 8", f"{PLACES}\n{beside}", text))
    assert "cannot be combined with positions" in error.message


def test_too_few_cells_are_told_when_the_mesh_is_made() -> None:
    text = FILE.replace("count = 8", "count = 32") + "[mesh]\ncells = 50\n"
    with pytest.raises(SkinError, match="50 cells are too few for") as caught:
        Skin.from_toml(text, source="my.toml").mesh()
    assert caught.value.where == "my.toml: [mesh] cells"


def test_broken_toml_names_the_line() -> None:
    error = failure("format = 1\n[skin\n")
    assert "line 2" in error.message


@pytest.mark.parametrize("value", ["9" * 5000, "[" * 100_000, "1" + "0" * 400, "1e999"])
def test_values_beyond_all_bounds(value: str) -> None:
    for key in ("count = 8", '"20 cm"'):
        new = f"count = {value}" if "count" in key else value
        assert str(failure(changed(key, new))).startswith("my.toml")


def test_file_on_disk(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(FILE, encoding="utf-8-sig")  # some editors put a mark in front
    for given in (path, str(path)):
        skin = Skin.load(given)
        assert (skin.name, skin.source) == ("mine", str(path))


def test_file_errors_name_the_file(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(changed("count = 8", "count = 3"))
    with pytest.raises(SkinError) as caught:
        Skin.load(path)
    assert caught.value.where == f"{path}: [electrodes] count"


def test_files_that_are_no_skin_files(tmp_path: Path) -> None:
    binary = tmp_path / "binary.toml"
    binary.write_bytes(bytes(range(256)))
    large = tmp_path / "large.toml"
    large.write_text("#" * 1_000_001)
    empty = tmp_path / "empty.toml"
    empty.touch()
    cases = {
        tmp_path: "folder",
        binary: "not a text file",
        large: "too large",
        empty: "is an empty file",
        tmp_path / "none.toml": "no such file",
        Path("/dev/null"): "device",
    }
    for path, message in cases.items():
        with pytest.raises(SkinError, match=message) as caught:
            Skin.load(path)
        assert str(path) in caught.value.where


@pytest.mark.parametrize("name", ["", "a\0b", "x" * 5000])
def test_names_that_are_no_paths(name: str) -> None:
    with pytest.raises(SkinError):
        Skin.load(name)
