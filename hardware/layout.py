"""Writes kicad/board-8.kicad_pcb and board-16.kicad_pcb: places, routes, fills. For KiCad's Python.

``python3 hardware/layout.py [8|16]``; needs KiCad 9 and a C++ compiler (for router.cpp).
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

import pcbnew

from netlist import Part, read
from placement import (
    HEADERS,
    HEIGHT,
    LABELS,
    LINK,
    MARGIN,
    RAILS,
    STEP,
    TEST_POINTS,
    TILE,
    outline,
    places,
    width,
)
from stackup import kicad

HERE = Path(__file__).resolve().parent
KICAD = HERE / "kicad"
FOOTPRINTS = Path("/usr/share/kicad/footprints")
ORIGIN = 50.0
CLASSES = (0.2, 0.4, 0.6)
"""Widths of tracks, mm: signals; supplies; the current's path."""
CURRENT, SUPPLY = (
    ("BUS", "/EL", "SENSE", "Net-(Q22-D)", "Net-(Q21-D)"),
    ("+12V", "+5V", "-5V", "RAW", "CAP"),
)
LAYERS = (pcbnew.F_Cu, pcbnew.In2_Cu, pcbnew.B_Cu)
SILK_SIZE = 0.8


def mm(value: float) -> int:
    """Millimetres in KiCad's unit."""
    return pcbnew.FromMM(round(value, 4))


def at(x: float, y: float) -> pcbnew.VECTOR2I:
    """A point of the board."""
    return pcbnew.VECTOR2I(mm(ORIGIN + x), mm(ORIGIN + y))


def class_of(net: str) -> int:
    """Number of the class of a net's tracks."""
    name = net.rsplit("/", 1)[-1]
    if name in ("BUS", "SENSE", "EL") or net in CURRENT:
        return 2
    return 1 if any(word in net for word in SUPPLY) else 0


class Layout:
    """A board in the making."""

    def __init__(self, channels: int) -> None:
        self.channels = channels
        self.file = KICAD / f"board-{channels}.kicad_pcb"
        self.parts, nets = read(KICAD / f"board-{channels}.kicad_sch")
        self.file.unlink(missing_ok=True)
        self.board = pcbnew.NewBoard(str(self.file))
        self.board.SetCopperLayerCount(4)
        self.nets: dict[str, pcbnew.NETINFO_ITEM] = {}
        for name in sorted(nets):
            self.nets[name] = pcbnew.NETINFO_ITEM(self.board, name)
            self.board.Add(self.nets[name])
        self.pin_nets = {node: name for name, nodes in nets.items() for node in nodes}
        settings = self.board.GetDesignSettings()
        settings.SetAuxOrigin(at(0, HEIGHT))
        settings.m_MinResolvedSpokes = 1
        settings.m_HoleClearance = settings.m_HoleToHoleMin = mm(0.25)
        settings.m_CopperEdgeClearance = mm(0.5)

    def net(self, short: str) -> str:
        """Full name of a rail: BUS is /BUS."""
        return short if short in self.nets else f"/{short}"

    def place(self) -> None:
        """All parts, with their nets; ValueError names one without a place."""
        wanted = places(self.channels)
        missing = sorted(set(self.parts) - set(wanted))
        if missing:
            raise ValueError(f"placement.py: expected a place for each part, none for {missing}")
        for reference, part in self.parts.items():
            x, y, turn = wanted[reference]
            footprint = _load(part)
            self.board.Add(footprint)
            footprint.SetPosition(at(x, y))
            footprint.SetOrientationDegrees(turn)
            if reference in HEADERS:
                _turn_header(footprint, HEADERS[reference])
            for pad in footprint.Pads():
                name = self.pin_nets.get((reference, pad.GetNumber()))
                if name:
                    pad.SetNet(self.nets[name])
            _letter(footprint, reference)

    def draw(self) -> None:
        """Outline and labels."""
        corners = outline(self.channels)
        for start, end in zip(corners, corners[1:] + corners[:1], strict=True):
            line = pcbnew.PCB_SHAPE(self.board, pcbnew.SHAPE_T_SEGMENT)
            line.SetStart(at(*start))
            line.SetEnd(at(*end))
            line.SetLayer(pcbnew.Edge_Cuts)
            line.SetWidth(mm(0.1))
            self.board.Add(line)
        for text, x, y, size in LABELS:
            self.text(text, x, y, size)
        for number in range(self.channels):
            x = MARGIN + TILE * number
            self.text(f"E{number + 1}", x + 8.1, 11.85, 0.8)
            self.text("GND", x + 3.1, 11.85, 0.8)
        for reference, name in TEST_POINTS.items():
            x, y, _ = places(self.channels)[reference]
            self.text(name, x, y - 2.1, 0.8)

    @property
    def left(self) -> float:
        """Where rails begin."""
        return 1.5

    @property
    def right(self) -> float:
        """Where rails end."""
        return MARGIN + TILE * self.channels - 1.5

    def text(self, words: str, x: float, y: float, size: float) -> None:
        """A label on the front."""
        text = pcbnew.PCB_TEXT(self.board)
        text.SetText(words)
        text.SetLayer(pcbnew.F_SilkS)
        text.SetTextSize(pcbnew.VECTOR2I(mm(size), mm(size)))
        text.SetTextThickness(mm(max(0.12, size * 0.15)))
        text.SetPosition(at(x, y))
        self.board.Add(text)

    def track(self, net: str, layer: int, wide: float, *ends: float) -> None:
        """A track, from x1, y1 to x2, y2."""
        one = pcbnew.PCB_TRACK(self.board)
        one.SetNet(self.nets[net])
        one.SetLayer(LAYERS[layer])
        one.SetWidth(mm(wide))
        one.SetStart(at(*ends[:2]))
        one.SetEnd(at(*ends[2:]))
        self.board.Add(one)

    def via(self, net: str, x: float, y: float) -> None:
        """A via through all layers."""
        one = pcbnew.PCB_VIA(self.board)
        one.SetNet(self.nets[net])
        one.SetPosition(at(x, y))
        one.SetWidth(mm(0.6))
        one.SetDrill(mm(0.3))
        self.board.Add(one)

    def route(self, router: str) -> None:
        """Tracks and vias by the router; RuntimeError where it leaves a net."""
        codes = {name: number for number, name in enumerate(sorted(self.nets), start=1)}
        names = {number: name for name, number in codes.items()}
        done = subprocess.run(
            [router],
            input="\n".join(self.problem(codes)),
            capture_output=True,
            text=True,
            check=False,
        )
        print(done.stderr[-400:], file=sys.stderr)
        for line in done.stdout.splitlines():
            kind, net, *rest = line.split()
            if kind == "via":
                self.via(names[int(net)], *map(float, rest))
            else:
                self.track(names[int(net)], int(rest[0]), *map(float, rest[1:]))
        self.rails()
        if done.returncode:
            print(f"board-{self.channels}: nets are left unrouted:\n{done.stderr}", file=sys.stderr)

    def rails(self) -> None:
        """The rails, from the first to the last place where something joins them."""
        for rail in RAILS:
            name = self.net(rail.net)
            ends = [
                point
                for one in self.board.GetTracks()
                if one.GetNetname() == name
                and (one.Type() == pcbnew.PCB_VIA_T or one.GetLayer() == LAYERS[1])
                for point in (one.GetStart(), one.GetEnd())
            ]
            joined = [p.x for p in ends if abs(pcbnew.ToMM(p.y) - ORIGIN - rail.y) < 0.01]
            left, right = (pcbnew.ToMM(x) - ORIGIN for x in (min(joined), max(joined)))
            left = self.left if rail.net == LINK[0] else left
            self.track(name, 1, rail.width, left, rail.y, right, rail.y)
        self.track(LINK[0], 1, 0.8, self.left, LINK[1], self.left, LINK[2])

    def problem(self, codes: dict[str, int]) -> list[str]:
        """What the router reads."""
        lines = [
            f"board {width(self.channels)} {HEIGHT} 0.1 0.2 0.6 0.5",
            *(f"class {w}" for w in CLASSES),
        ]
        if self.channels > 8:
            lines.append(f"block 7 {width(8) - 0.5} {STEP - 0.5} {width(self.channels)} {HEIGHT}")
        counts: dict[str, int] = {}
        for footprint in self.board.GetFootprints():
            for pad in footprint.Pads():
                lines.append(_pad_line(pad, codes))
                counts[pad.GetNetname()] = counts.get(pad.GetNetname(), 0) + 1
        for rail in RAILS:
            name = self.net(rail.net)
            lines.append(
                f"rail {codes[name]} 1 {rail.width} {self.left} {rail.y} {self.right} {rail.y}"
            )
        lines.append(f"rail {codes[LINK[0]]} 1 0.8 {self.left} {LINK[1]} {self.left} {LINK[2]}")
        for name, count in counts.items():
            if name and name != "GND" and count > 1:
                lines.append(f"net {codes[name]} {class_of(name)}")
        return [*lines, f"ground {codes['GND']} 1"]

    def pour(self) -> None:
        """Pours, not filled yet: ground on all layers; copper under the source's transistor."""
        whole = [(x, y) for x, y in outline(self.channels)]
        for layer in (pcbnew.F_Cu, pcbnew.In1_Cu, pcbnew.In2_Cu, pcbnew.B_Cu):
            self.zone("GND", layer, whole, 0)
        self.zone(self.net("BUS"), pcbnew.F_Cu, [(1, 57), (12.2, 57), (12.2, 67), (1, 67)], 1)

    def zone(self, net: str, layer: int, corners: list[tuple[float, float]], priority: int) -> None:
        """A pour of copper."""
        zone = pcbnew.ZONE(self.board)
        zone.SetNet(self.nets[net])
        zone.SetLayer(layer)
        zone.SetAssignedPriority(priority)
        zone.SetLocalClearance(mm(0.25))
        zone.SetMinThickness(mm(0.2))
        zone.SetPadConnection(pcbnew.ZONE_CONNECTION_THT_THERMAL)
        zone.SetIslandRemovalMode(pcbnew.ISLAND_REMOVAL_MODE_ALWAYS)
        points = zone.Outline()
        points.NewOutline()
        for x, y in corners:
            points.Append(at(x, y))
        self.board.Add(zone)


def _load(part: Part) -> pcbnew.FOOTPRINT:
    """The footprint of a part, with what the schematic says of it."""
    library, name = part.footprint.split(":")
    footprint = pcbnew.FootprintLoad(str(FOOTPRINTS / f"{library}.pretty"), name)
    footprint.SetFPID(pcbnew.LIB_ID(library, name))
    footprint.SetReference(part.reference)
    footprint.SetValue(part.value)
    footprint.SetPath(pcbnew.KIID_PATH(part.path))
    for field, text in part.fields.items():
        if not footprint.HasField(field):
            footprint.SetField(field, text)
            footprint.GetFieldByName(field).SetVisible(False)
            footprint.GetFieldByName(field).SetLayer(pcbnew.F_Fab)
        else:
            footprint.SetField(field, text)
    if not part.in_bom:
        footprint.SetAttributes(
            footprint.GetAttributes()
            | pcbnew.FP_EXCLUDE_FROM_BOM
            | pcbnew.FP_EXCLUDE_FROM_POS_FILES
        )
    return footprint


def _turn_header(footprint: pcbnew.FOOTPRINT, pins: int) -> None:
    """Below the board, its pins where the Mega's sockets are."""
    footprint.Flip(footprint.GetPosition(), pcbnew.FLIP_DIRECTION_LEFT_RIGHT)
    way = (0, -1) if pins == 36 else (1, 0)
    for turn in (0, 90, 180, 270):
        footprint.SetOrientationDegrees(turn)
        first, third = (
            footprint.FindPadByNumber(str(n)).GetPosition() for n in (1, 3 if pins == 36 else 2)
        )
        if (
            round(pcbnew.ToMM(third.x - first.x) / 2.54),
            round(pcbnew.ToMM(third.y - first.y) / 2.54),
        ) == way:
            break
    if pins == 36:
        second = footprint.FindPadByNumber("2").GetPosition()
        if second.x < first.x:
            raise ValueError(f"{footprint.GetReference()}: pin 2 left of pin 1")


def _letter(footprint: pcbnew.FOOTPRINT, reference: str) -> None:
    """References of the larger chips on the silk screen, the others' on the assembly drawing."""
    text = footprint.Reference()
    text.SetTextSize(pcbnew.VECTOR2I(mm(SILK_SIZE), mm(SILK_SIZE)))
    text.SetTextThickness(mm(0.12))
    footprint.Value().SetVisible(False)
    if reference.startswith("TP"):
        text.SetVisible(False)
        return
    inside = footprint.GetFPIDAsString().startswith("Package_SO:")
    text.SetPosition(footprint.GetPosition())
    if inside:
        text.SetTextAngleDegrees(0 if footprint.GetOrientationDegrees() else 90)
        return
    text.SetLayer(pcbnew.B_Fab if footprint.IsFlipped() else pcbnew.F_Fab)
    for item in footprint.GraphicalItems():
        if isinstance(item, pcbnew.PCB_TEXT) and "REFERENCE" in item.GetText():
            item.SetVisible(False)


def _pad_line(pad: pcbnew.PAD, codes: dict[str, int]) -> str:
    """A pad as the router reads it."""
    box = pad.GetBoundingBox()
    layers = sum(1 << n for n, layer in enumerate(LAYERS) if pad.IsOnLayer(layer))
    hole = pad.GetDrillSizeX() > 0
    x, y = (pcbnew.ToMM(v) - ORIGIN for v in (box.GetCenter().x, box.GetCenter().y))
    w, h = pcbnew.ToMM(box.GetWidth()), pcbnew.ToMM(box.GetHeight())
    if not pad.GetNumber() or pad.GetAttribute() == pcbnew.PAD_ATTRIB_NPTH:
        w, h = (
            max(w, pcbnew.ToMM(pad.GetDrillSizeX()) + 0.2),
            max(h, pcbnew.ToMM(pad.GetDrillSizeY()) + 0.2),
        )
    code = codes.get(pad.GetNetname(), -1)
    return f"pad {code} {7 if hole else layers} {x:.4f} {y:.4f} {w:.4f} {h:.4f} {int(hole)}"


def fill(file: Path) -> None:
    """Fill the pours of a saved board: only one that was read keeps them off bare holes."""
    board = pcbnew.LoadBoard(str(file))
    pcbnew.ZONE_FILLER(board).Fill(board.Zones())
    pcbnew.SaveBoard(str(file), board)
    text = file.read_text(encoding="utf-8")  # pcbnew cannot set a stack-up
    file.write_text(text.replace("\t(setup\n", "\t(setup\n" + kicad(), 1), encoding="utf-8")


def main() -> None:
    """Make the boards that are named, or both."""
    with tempfile.TemporaryDirectory() as folder:
        router = f"{folder}/router"
        subprocess.run(
            ["c++", "-O2", "-std=c++17", str(HERE / "router.cpp"), "-o", router], check=True
        )
        for channels in map(int, sys.argv[1:] or ("8", "16")):
            layout = Layout(channels)
            layout.place()
            layout.draw()
            if "--dry" not in sys.argv:
                layout.route(router)
            layout.pour()
            pcbnew.SaveBoard(str(layout.file), layout.board)
            fill(layout.file)


if __name__ == "__main__":
    main()
