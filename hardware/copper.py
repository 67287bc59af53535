"""The copper of a layout: resistance between pads, capacitance to the ground plane, heating."""

from __future__ import annotations

import math
import re
from collections import defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from stackup import LAYERS, VIA_OHMS, Layer

ROOT = Path(__file__).resolve().parent
_RESISTIVITY = 1.72e-5
"""Of copper, Ω mm."""

_NEAR = 0.02
"""mm: ends that are no further from another track's axis or from a pad are joined to it."""

_BY_NET = r'\(layer "([^"]+)"\)\s+\(net (\d+)\)'
_SEGMENT = re.compile(
    r"\(segment\s+\(start (\S+) (\S+)\)\s+\(end (\S+) (\S+)\)\s+\(width (\S+)\)\s+" + _BY_NET
)
_VIA = re.compile(r"\(via\s+\(at (\S+) (\S+)\)\s.*?\(net (\d+)\)", re.DOTALL)
_NET = re.compile(r'^\t\(net (\d+) "([^"]*)"\)', re.MULTILINE)
_FOOTPRINT = re.compile(r"^\t\(footprint .*?^\t\)", re.MULTILINE | re.DOTALL)
_AT = re.compile(r"^\t\t\(at (\S+) (\S+?)(?: (\S+))?\)", re.MULTILINE)
_REFERENCE = re.compile(r'\(property "Reference" "([^"]+)"')
_PAD = re.compile(
    r'\(pad "([^"]*)" (\S+) \S+\s+\(at (\S+) (\S+?)(?: (\S+))?\)\s+\(size (\S+) (\S+)\)'
    r'.*?\(layers ([^)]*)\).*?(?:\(net (\d+) "[^"]*"\)|\n\t\t\))',
    re.DOTALL,
)
_EDGE = re.compile(
    r'\(gr_line\s+\(start (\S+) (\S+)\)\s+\(end [^)]*\)(?:(?!\(gr_line).)*?"Edge\.Cuts"', re.DOTALL
)
_POUR = re.compile(
    r'\(zone\s+\(net \d+\)\s+\(net_name "([^"]+)"\)\s+\(layer "([^"]+)"\)'
    r".*?\(polygon\s+\(pts(.*?)\)\s+\)\s",
    re.DOTALL,
)
Point = tuple[float, float]


def places(file: Path) -> dict[str, Point]:
    """Where each part of a .kicad_pcb stands, mm from the upper left corner of the board."""
    text = file.read_text(encoding="utf-8")
    edges = [float(value) for line in _EDGE.findall(text) for value in line]
    left, top = min(edges[::2]), min(edges[1::2])
    found = {}
    for part in _FOOTPRINT.findall(text):
        (reference,), (x, y, _) = _REFERENCE.findall(part), _AT.findall(part)[0]
        found[reference] = (float(x) - left, float(y) - top)
    return found


@dataclass(frozen=True)
class Track:
    """A straight track: ends and width in mm."""

    net: str
    layer: str
    start: Point
    end: Point
    width: float

    @property
    def length(self) -> float:
        """Of its axis, mm."""
        return math.dist(self.start, self.end)


@dataclass(frozen=True)
class Pad:
    """A pad: its middle, mm; half sides, mm; turn, radians; layers (empty: all)."""

    name: tuple[str, str]
    net: str
    middle: Point
    half: Point
    turn: float
    layers: frozenset[str]

    def holds(self, point: Point, layer: str) -> bool:
        """Whether a track's end is on it."""
        if self.layers and layer not in self.layers:
            return False
        dx, dy = point[0] - self.middle[0], point[1] - self.middle[1]
        c, s = math.cos(self.turn), math.sin(self.turn)
        along, across = dx * c - dy * s, dx * s + dy * c
        return abs(along) <= self.half[0] + _NEAR and abs(across) <= self.half[1] + _NEAR


@dataclass(frozen=True)
class Copper:
    """Tracks, vias (net, place), pads, and pours but ground's (net, layer, box)."""

    tracks: list[Track]
    vias: list[tuple[str, Point]]
    pads: dict[tuple[str, str], Pad]
    pours: list[tuple[str, str, tuple[float, float, float, float]]]

    @classmethod
    def read(cls, file: Path) -> Copper:
        """That of a .kicad_pcb."""
        text = file.read_text(encoding="utf-8")
        nets = dict(_NET.findall(text))
        tracks = [
            Track(nets[net], layer, (float(a), float(b)), (float(c), float(d)), float(width))
            for a, b, c, d, width, layer, net in _SEGMENT.findall(text)
        ]
        vias = [(nets[net], (float(x), float(y))) for x, y, net in _VIA.findall(text)]
        pads = {pad.name: pad for part in _FOOTPRINT.findall(text) for pad in _pads(part, nets)}
        pours = []
        for net, layer, corners in _POUR.findall(text):
            if net != "GND":
                xy = np.array(re.findall(r"\(xy (\S+) ([^)\s]+)\)", corners), dtype=float)
                pours.append((net, layer, (*xy.min(axis=0), *xy.max(axis=0))))
        return cls(tracks, vias, pads, pours)

    def potentials(
        self, into: tuple[str, str], out: tuple[str, str], *others: tuple[str, str]
    ) -> list[float]:
        """Ω from ``out`` to ``into``, and to others that carry nothing: 1 A between two pads.

        All on one net; ValueError where its copper does not join them.
        """
        net = self.pads[into].net
        nodes, edges = self._graph(net)
        ends = [nodes[pad, ""] for pad in (into, out, *others)]
        n = len(nodes)
        matrix = np.zeros((n, n))
        for a, b, siemens in edges:
            matrix[[a, b], [a, b]] += siemens
            matrix[[a, b], [b, a]] -= siemens
        matrix[range(n), range(n)] += 1e-9
        current = np.zeros(n)
        current[ends[0]], current[ends[1]] = 1.0, -1.0
        volts = np.linalg.solve(matrix, current)
        ohms = [float(volts[end] - volts[ends[1]]) for end in (ends[0], *ends[2:])]
        if max(ohms) > 10:
            raise ValueError(f"{net}: {into} and {out} are not joined by its copper")
        return ohms

    def _graph(self, net: str) -> tuple[dict[object, int], list[tuple[int, int, float]]]:
        """Nodes of a net, numbered; conductors between them."""
        nodes: dict[object, int] = {}

        def node(key: object) -> int:
            return nodes.setdefault(key, len(nodes))

        mine = [track for track in self.tracks if track.net == net]
        vias = [place for name, place in self.vias if name == net]
        points: dict[str, set[Point]] = defaultdict(set)
        for track in mine:
            points[track.layer] |= {track.start, track.end}
        for place in vias:
            for layer in LAYERS:
                points[layer].add(place)
        edges = []
        for track in mine:
            chain = sorted(_along(track, points[track.layer]))
            ohms = _RESISTIVITY / (LAYERS[track.layer].thickness * track.width)
            for (at, one), (then, other) in pairwise(chain):
                siemens = 1 / max(ohms * (then - at), 1e-7)
                edges.append((node((one, track.layer)), node((other, track.layer)), siemens))
        for place in vias:
            here = [node((place, layer)) for layer in LAYERS]
            edges += [(a, b, 3 / VIA_OHMS) for a, b in pairwise(here)]
        joined = [(pad, pad.holds) for pad in self.pads.values() if pad.net == net]
        for key, holds in joined:
            middle = node((key.name, ""))
            edges += [
                (middle, node((p, layer)), 1e7)
                for layer in points
                for p in points[layer]
                if holds(p, layer)
            ]
        for name, layer, (x0, y0, x1, y1) in self.pours:
            if name == net:
                middle = node(("pour", layer))
                inside = [p for p in points[layer] if x0 <= p[0] <= x1 and y0 <= p[1] <= y1]
                edges += [(middle, node((p, layer)), 1e7) for p in inside]
        return nodes, edges

    def capacitance(self, net: str) -> float:
        """Of a net's tracks and pads to the planes beside them, F."""
        total = 0.0
        for track in self.tracks:
            if track.net == net:
                total += track.length * 1e-3 * LAYERS[track.layer].per_metre(track.width)
        for pad in self.pads.values():
            if pad.net == net:
                width, length = sorted((2 * pad.half[0], 2 * pad.half[1]))
                for layer in ("F.Cu", "B.Cu"):
                    if not pad.layers or layer in pad.layers:
                        total += length * 1e-3 * LAYERS[layer].per_metre(width)
        for name, layer, (x0, y0, x1, y1) in self.pours:
            if name == net:
                total += (y1 - y0) * 1e-3 * LAYERS[layer].per_metre(x1 - x0)
        return total

    def narrowest(self) -> dict[str, tuple[float, str]]:
        """The least width of each net's tracks, mm, and the layer with the thinnest copper."""
        found: dict[str, tuple[float, str]] = {}
        for track in self.tracks:
            width, layer = found.get(track.net, (math.inf, track.layer))
            thinner = min((layer, track.layer), key=lambda name: LAYERS[name].thickness)
            found[track.net] = (min(width, track.width), thinner)
        return found


def _pads(part: str, nets: dict[str, str]) -> Iterator[Pad]:
    x, y, turn = (float(v or 0) for v in _AT.search(part).groups())  # type: ignore[union-attr]
    reference = _REFERENCE.search(part)[1]  # type: ignore[index]
    c, s = math.cos(math.radians(turn)), math.sin(math.radians(turn))
    for number, kind, px, py, angle, w, h, layers, net in _PAD.findall(part):
        if net:
            dx, dy = float(px), float(py)
            middle = (x + dx * c + dy * s, y - dx * s + dy * c)
            on = () if kind == "thru_hole" else re.findall(r'"([^"]+\.Cu)"', layers)
            half = (float(w) / 2, float(h) / 2)
            turned = math.radians(float(angle or 0))
            yield Pad((reference, number), nets[net], middle, half, turned, frozenset(on))


def _along(track: Track, points: Iterable[Point]) -> Iterator[tuple[float, Point]]:
    """The points on a track's axis, and how far along it, mm."""
    (x0, y0), length = track.start, track.length
    if not length:
        return
    ux, uy = (track.end[0] - x0) / length, (track.end[1] - y0) / length
    for point in points:
        dx, dy = point[0] - x0, point[1] - y0
        at = dx * ux + dy * uy
        if -_NEAR <= at <= length + _NEAR and abs(dy * ux - dx * uy) <= _NEAR:
            yield at, point


def heating(amperes: float, width: float, layer: Layer) -> float:
    """Kelvins above the board, by IPC-2221: I = k ΔT^0.44 A^0.725, A in square mils."""
    mils = width * layer.thickness / 0.0254**2
    ratio: float = amperes / (layer.ipc * mils**0.725)
    return math.pow(ratio, 1 / 0.44)
