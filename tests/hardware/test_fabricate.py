"""What one orders: outputs of their sources, rules, widths for the current, the Mega's holes."""

import re
import shutil
import zipfile

import pytest

import bill
import fabricate
import pins
import wiring
from circuit import ROOT, Circuit
from copper import places

MEGA_LEFT = 11.0
"""Millimetres by which the Mega's left edge is left of the board's: its USB socket stays free."""

MEGA = ["board-8", "board-16"]
PAGES = (MEGA_PAGE := "hardware.md", "pico.md")
WIDEST = {"current": 0.6, "supply": 0.4, "signal": 0.2}
_SEGMENT = re.compile(
    r"\(segment\s+\(start [^)]*\)\s+\(end [^)]*\)\s+"
    r'\(width ([\d.]+)\)\s+\(layer "([^"]+)"\)\s+\(net (\d+)\)'
)
_NET = re.compile(r'^\t\(net (\d+) "([^"]*)"\)', re.MULTILINE)


@pytest.fixture(scope="module")
def kicad():
    """Skip, loudly, what asks KiCad where it is not: the hashes were compared all the same."""
    if shutil.which("kicad-cli") is None:
        pytest.skip(
            "the boards' rules: no kicad-cli (Debian 12: kicad of bookworm-backports); "
            "hashes were compared instead"
        )


def tracks(board):
    """Width, layer and net of each track of a board."""
    text = (fabricate.KICAD / f"{board}.kicad_pcb").read_text(encoding="utf-8")
    names = dict(_NET.findall(text))
    return [(float(width), layer, names[net]) for width, layer, net in _SEGMENT.findall(text)]


def kind(net):
    name = net.rsplit("/", 1)[-1]
    if name in ("BUS", "EL", "SENSE"):
        return "current"
    return "supply" if name in ("+12V", "+5V", "-5V", "RAW", "INPUT") else "signal"


def test_outputs_are_those_of_their_sources():
    assert fabricate.stale() == [], "run make board, with KiCad 9"


@pytest.mark.parametrize("board", MEGA)
def test_tracks_are_as_wide_as_their_current_asks(board):
    found = tracks(board)
    assert {kind(net) for _, _, net in found} == set(WIDEST)
    assert [track for track in found if track[0] < WIDEST[kind(track[2])] - 1e-9] == []


@pytest.mark.parametrize("board", MEGA)
def test_the_plane_under_the_signals_is_whole(board):
    assert [track for track in tracks(board) if track[1] == "In1.Cu"] == []


def test_an_input_of_an_amplifier_is_short():
    """From filter to amplifier less than 4 mm, in a straight line between the parts' middles."""
    where = places(fabricate.KICAD / "board-8.kicad_pcb")
    for near in ("C101", "C102", "R106", "R107"):
        (x1, y1), (x2, y2) = where[near], where["U101"]
        assert abs(x1 - x2) + abs(y1 - y2) < 9
        assert abs(y1 - y2) < 4


def test_headers_and_holes_are_where_the_mega_has_them():
    """Its drawing, mm from its left and lower edge: first pins of headers, three of its holes."""
    where = places(fabricate.KICAD / "board-16.kicad_pcb")
    drawing = {
        "J61": (27.94, 2.54),
        "J62": (50.8, 2.54),
        "J63": (73.66, 2.54),
        "J64": (93.98, 7.62),
    }
    drawing |= {"H1": (15.24, 50.8), "H2": (13.97, 2.54), "H5": (96.52, 2.54)}
    for reference, (x, y) in drawing.items():
        found = where[reference]
        assert (found[0] + MEGA_LEFT, 99.5 - found[1]) == pytest.approx((x, y), abs=0.01)


@pytest.mark.parametrize("board", fabricate.BOARDS)
def test_the_zip_holds_what_a_factory_asks_for(board):
    with zipfile.ZipFile(ROOT / f"{board}.zip") as archive:
        names = archive.namelist()
        positions = archive.read(f"{board}-positions.csv").decode().splitlines()
        bought = archive.read(f"{board}-bom.csv").decode()
    copper = ["F_Cu", "B_Cu"] if board == "pico-16" else ["F_Cu", "In1_Cu", "In2_Cu", "B_Cu"]
    layers = [*copper, "F_Mask", "B_Mask", "F_Paste", "F_Silkscreen", "Edge_Cuts"]
    assert len([name for name in names if "_Cu." in name]) == len(copper)
    assert [one for one in layers if not any(one in name for name in names)] == []
    assert sum(name.endswith(".drl") for name in names) == 2
    assert f"{board}-assembly.pdf" in names
    circuit = Circuit.read(board)
    assert bought == bill.bill(circuit.parts)
    placed = {line.split(",")[0].strip('"') for line in positions[1:]}
    assert placed <= set(circuit.parts)
    chips = {name for name in circuit.parts if name[0] == "U"}
    assert chips - {"U1"} <= placed  # the Pico itself is soldered by hand


def test_the_pages_have_the_positions_and_sizes_of_the_files():
    """What a factory asks for first."""
    pages = {name: (ROOT.parent / "docs" / name).read_text(encoding="utf-8") for name in PAGES}
    counts, widths = {}, {}
    for board in fabricate.BOARDS:
        with zipfile.ZipFile(ROOT / f"{board}.zip") as archive:
            counts[board] = len(archive.read(f"{board}-positions.csv").decode().splitlines()) - 1
        layout = (fabricate.KICAD / f"{board}.kicad_pcb").read_text(encoding="utf-8")
        edge = re.findall(
            r"\(gr_\w+\s+((?:(?!\(layer).)*)\(layer \"Edge.Cuts\"\)", layout, re.DOTALL
        )
        xs = [float(x) for text in edge for x in re.findall(r"\((?:start|end|mid) (\S+) ", text)]
        widths[board] = round(max(xs) - min(xs), 1)
    assert (
        f"{counts['board-8']} positions of the front ({counts['board-16']} with" in pages[MEGA_PAGE]
    )
    assert f"{widths['board-8']} × 99.5 mm ({widths['board-16']} × 99.5 mm" in pages[MEGA_PAGE]
    assert f"{counts['pico-16']} positions" in pages["pico.md"]
    assert f"{widths['pico-16']:g} × 50 mm" in pages["pico.md"]


@pytest.mark.parametrize("board", fabricate.BOARDS)
def test_a_machine_that_places_parts_has_three_marks_not_in_a_line(board):
    where = places(fabricate.KICAD / f"{board}.kicad_pcb")
    (ax, ay), (bx, by), (cx, cy) = (where[f"FID{n}"] for n in (1, 2, 3))
    assert abs((bx - ax) * (cy - ay) - (cx - ax) * (by - ay)) > 20**2


def test_a_changed_source_is_noticed(monkeypatch, tmp_path):
    text = fabricate.MANIFEST.read_text(encoding="utf-8")
    digest = re.search(r'channel\.kicad_sch" = "(\w+)"', text)[1]
    changed = tmp_path / "outputs.toml"
    changed.write_text(text.replace(digest, "0" * 64), encoding="utf-8")
    monkeypatch.setattr(fabricate, "MANIFEST", changed)
    assert fabricate.stale() == ["hardware/kicad/channel.kicad_sch"]


@pytest.mark.usefixtures("kicad")
@pytest.mark.parametrize("board", ["board-8", "pico-16"])
def test_rules_and_parity_of_the_small_boards(board):
    fabricate.check(board)


@pytest.mark.slow
@pytest.mark.usefixtures("kicad")
def test_rules_and_parity_of_the_large_board():
    fabricate.check("board-16")


@pytest.mark.usefixtures("kicad")
@pytest.mark.parametrize("board", fabricate.BOARDS)
def test_the_committed_netlist_is_that_of_the_schematic(board):
    circuit = Circuit.read(board)
    assert fabricate.listed(board) == (circuit.parts, circuit.nets)


@pytest.mark.slow
@pytest.mark.usefixtures("kicad")
def test_a_lost_track_is_found(monkeypatch, tmp_path):
    shutil.copytree(fabricate.KICAD, tmp_path / "kicad")
    board = tmp_path / "kicad" / "board-8.kicad_pcb"
    text = board.read_text(encoding="utf-8")
    board.write_text(
        re.sub(r"\n\t\(segment.*?\n\t\)", "", text, count=40, flags=re.DOTALL), encoding="utf-8"
    )
    monkeypatch.setattr(fabricate, "KICAD", tmp_path / "kicad")
    with pytest.raises(fabricate.BoardError, match="unconnected"):
        fabricate.check("board-8")


def test_the_picture_of_a_wired_skin_is_not_stale():
    assert wiring.FILE.read_text(encoding="utf-8") == wiring.wiring()


def test_every_signal_has_a_pin():
    assert len(pins.signals(pins.read(pins.TABLE.read_text(encoding="utf-8")))) == 27
