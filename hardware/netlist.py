"""Reads a schematic's netlist, as kicad-cli writes it."""

from __future__ import annotations

import re
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

_TOKEN = re.compile(r'"((?:[^"\\]|\\.)*)"|([()])|([^\s()"]+)')


@dataclass(frozen=True)
class Part:
    """A part of the schematic; ``path`` is that of its symbol, by which KiCad finds it."""

    reference: str
    value: str
    footprint: str
    path: str
    fields: dict[str, str]
    in_bom: bool


Nets = dict[str, list[tuple[str, str]]]


def export(schematic: Path) -> str:
    """The netlist of a schematic; CalledProcessError where kicad-cli fails."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "board.net"
        command = ["kicad-cli", "sch", "export", "netlist", "--output", str(file), str(schematic)]
        subprocess.run(command, check=True, capture_output=True)
        return file.read_text(encoding="utf-8")


def read(schematic: Path) -> tuple[dict[str, Part], Nets]:
    """Parts by their reference, and the pins on each net."""
    return parse(export(schematic))


def parse(text: str) -> tuple[dict[str, Part], Nets]:
    """The same, of a netlist's text."""
    tree = _tree(text)
    parts = {}
    for comp in _all(_one(tree, "components"), "comp"):
        sheet = _text(_one(comp, "sheetpath"), "tstamps")
        properties = {_text(p, "name") for p in _all(comp, "property")}
        fields = {f[1][1]: f[2] for f in _all(_one(comp, "fields"), "field") if len(f) > 2}
        named = {k: v for k, v in fields.items() if k in ("Manufacturer", "MPN", "Mouser")}
        part = Part(
            _text(comp, "ref"),
            _text(comp, "value"),
            _text(comp, "footprint"),
            sheet + _text(comp, "tstamps"),
            named,
            "exclude_from_bom" not in properties,
        )
        parts[part.reference] = part
    nets = {
        _text(net, "name"): [(_text(node, "ref"), _text(node, "pin")) for node in _all(net, "node")]
        for net in _all(_one(tree, "nets"), "net")
    }
    return parts, nets


def written(parts: dict[str, Part], nets: Nets) -> str:
    """The same as text: without the date and the paths that KiCad writes into its own."""
    lines = ['(export (version "E")', "  (components"]
    for part in parts.values():
        fields = "".join(f'(field (name "{k}") "{v}")' for k, v in part.fields.items())
        sheet, _, symbol = part.path.rpartition("/")
        lines += [
            f'    (comp (ref "{part.reference}") (value "{part.value}")',
            f'      (footprint "{part.footprint}") (fields {fields})',
            *([] if part.in_bom else ['      (property (name "exclude_from_bom"))']),
            f'      (sheetpath (tstamps "{sheet}/")) (tstamps "{symbol}"))',
        ]
    lines += ["  )", "  (nets"]
    for code, (net, nodes) in enumerate(sorted(nets.items()), start=1):
        pins = " ".join(f'(node (ref "{reference}") (pin "{pin}"))' for reference, pin in nodes)
        lines.append(f'    (net (code "{code}") (name "{net}") {pins})')
    return "\n".join([*lines, "  )", ")"]) + "\n"


def _tree(text: str) -> list[Any]:
    stack: list[list[Any]] = [[]]
    for quoted, bracket, word in _TOKEN.findall(text):
        if bracket == "(":
            stack.append([])
        elif bracket == ")":
            done = stack.pop()
            stack[-1].append(done)
        else:
            stack[-1].append(word or quoted)
    tree: list[Any] = stack[0][0]
    return tree


def _all(node: list[Any], name: str) -> list[list[Any]]:
    return [item for item in node if isinstance(item, list) and item and item[0] == name]


def _one(node: list[Any], name: str) -> list[Any]:
    return next(iter(_all(node, name)), [name])


def _text(node: list[Any], name: str) -> str:
    found = _one(node, name)
    return str(found[1]) if len(found) > 1 else ""
