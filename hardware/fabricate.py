"""From the KiCad projects to what one uploads: ``python hardware/fabricate.py``, or ``make board``.

It runs the rule checks, then writes netlists, bills of materials, and for each board a zip
(Gerbers, drill files, bill, positions, assembly drawing), the schematic as PDF, pictures of both
sides, and into build/board STEP and an interactive bill (a page that shows each part on the board).
``outputs.toml`` holds the hashes of sources and outputs, so that without KiCad a test can say
whether they belong together. ``--check`` only checks.
"""

from __future__ import annotations

import csv
import hashlib
import io
import os
import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
import zipfile
from pathlib import Path

from bill import bill
from netlist import Nets, Part, read, written

ROOT = Path(__file__).resolve().parent
KICAD, MANIFEST = ROOT / "kicad", ROOT / "outputs.toml"
PICTURES, STEP = ROOT.parent / "docs" / "hardware", ROOT.parent / "build" / "board"
TOOLS = STEP / "tools"
PYTHON = "/usr/bin/python3"
"""KiCad's own, with pcbnew."""

BOARDS = {"board-8": (1000, 1000, 1), "board-16": (1500, 900, 1.65), "pico-16": (1200, 1000, 1)}
"""The projects; width and height of their pictures, pixels, and zoom."""

LAYERS = "F.Paste,F.Mask,B.Mask,F.Silkscreen,B.Silkscreen,Edge.Cuts"
"""Beside the copper."""

ASSEMBLY = "F.Fab,F.Courtyard,Edge.Cuts"
"""Of the drawing that says which part is where."""

PAGES = "1,2,3,4,5,6,7"
"""Of the schematic, up to the first channel: the others are the same sheet."""
POSITIONS = ["Designator", "Val", "Package", "Mid X", "Mid Y", "Rotation", "Layer"]
_EPOCH = (2026, 1, 1, 0, 0, 0)


class BoardError(Exception):
    """KiCad found something wrong, or is not there."""


def kicad(*words: object) -> None:
    """Run kicad-cli; BoardError with what it said when it fails."""
    program = shutil.which("kicad-cli")
    if program is None:
        raise BoardError(
            "expected kicad-cli of KiCad 9 (Debian 12: suite bookworm-backports), found none"
        )
    done = subprocess.run([program, *map(str, words)], capture_output=True, text=True, check=False)
    if done.returncode:
        raise BoardError(f"kicad-cli {' '.join(map(str, words[:3]))}: {done.stdout}{done.stderr}")


def check(name: str) -> None:
    """Electrical and design rules, and whether layout and schematic are one; BoardError else."""
    with tempfile.TemporaryDirectory() as folder:
        for kind, file in (("sch erc", "kicad_sch"), ("pcb drc", "kicad_pcb")):
            report = Path(folder) / "report.txt"
            options = ["--schematic-parity"] if file == "kicad_pcb" else []
            board = KICAD / f"{name}.{file}"
            try:
                kicad(
                    *kind.split(),
                    "--severity-all",
                    "--exit-code-violations",
                    *options,
                    "--output",
                    report,
                    board,
                )
            except BoardError as error:
                said = report.read_text(encoding="utf-8") if report.exists() else str(error)
                raise BoardError(f"{board.name}: {said[:3000]}") from error


def listed(name: str) -> tuple[dict[str, Part], Nets]:
    """Parts and nets of a schematic."""
    return read(KICAD / f"{name}.kicad_sch")


def make(name: str) -> list[Path]:
    """Write all files of a board; their paths, without those in build/."""
    board, schematic = KICAD / f"{name}.kicad_pcb", KICAD / f"{name}.kicad_sch"
    parts, nets = listed(name)
    (ROOT / f"{name}.net").write_text(written(parts, nets), encoding="utf-8")
    (ROOT / f"{name}.csv").write_text(bill(parts), encoding="utf-8")
    kicad("sch", "export", "pdf", "--pages", PAGES, "--output", ROOT / f"{name}.pdf", schematic)
    pictures = [_picture(board, side) for side in ("top", "bottom")]
    if name == "board-8":
        pictures.append(_first_page(schematic))
    STEP.mkdir(parents=True, exist_ok=True)
    kicad(
        "pcb",
        "export",
        "step",
        "--force",
        "--subst-models",
        "--output",
        STEP / f"{name}.step",
        board,
    )
    _interactive(board)
    packed = ROOT / f"{name}.zip"
    _pack(packed, board, ROOT / f"{name}.csv")
    return [ROOT / f"{name}{end}" for end in (".net", ".csv", ".pdf", ".zip")] + pictures


def _interactive(board: Path) -> None:
    """A page with both sides and the list of parts, by InteractiveHtmlBom under KiCad's Python."""
    if not TOOLS.is_dir():
        print(f"{board.stem}: no interactive bill, since it is made by make board", file=sys.stderr)
        return
    words = ["--no-browser", "--dest-dir", STEP, "--name-format", "%f-bill", "--include-nets"]
    words += ["--extra-fields", "Manufacturer,MPN,Mouser", board]
    start = "from InteractiveHtmlBom.generate_interactive_bom import main; main()"
    environment = os.environ | {"PYTHONPATH": str(TOOLS), "INTERACTIVE_HTML_BOM_NO_DISPLAY": "1"}
    done = subprocess.run(
        [PYTHON, "-c", start, *map(str, words)],
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode or not (STEP / f"{board.stem}-bill.html").is_file():
        raise BoardError(f"{board.name}: no interactive bill: {done.stderr[-1000:]}")


def _picture(board: Path, side: str) -> Path:
    file = PICTURES / f"{board.stem}-{side}.png"
    width, height, zoom = BOARDS[board.stem]
    size = ("--width", width, "--height", height, "--zoom", zoom)
    kicad("pcb", "render", "--side", side, *size, "--background", "opaque", "--output", file, board)
    return file


def _first_page(schematic: Path) -> Path:
    """The schematic's first page as a drawing, without the day on which it was drawn."""
    file = PICTURES / f"{schematic.stem}-schematic.svg"
    with tempfile.TemporaryDirectory() as folder:
        options = ("--pages", "1", "--exclude-drawing-sheet", "--output", folder)
        kicad("sch", "export", "svg", *options, schematic)
        text = (Path(folder) / f"{schematic.stem}.svg").read_text(encoding="utf-8")
    file.write_text(re.sub(r"<title>.*?</title>", "", text), encoding="utf-8")
    return file


def _pack(packed: Path, board: Path, bill_file: Path) -> None:
    with tempfile.TemporaryDirectory() as folder:
        to = Path(folder)
        layers = ",".join([*copper_layers(board), LAYERS])
        kicad("pcb", "export", "gerbers", "--layers", layers, "--output", to, board)
        kicad(
            "pcb",
            "export",
            "drill",
            "--excellon-separate-th",
            "--drill-origin",
            "absolute",
            "--output",
            f"{to}/",
            board,
        )
        raw = to / "raw.csv"
        kicad(
            "pcb",
            "export",
            "pos",
            "--format",
            "csv",
            "--units",
            "mm",
            "--smd-only",
            "--output",
            raw,
            board,
        )
        (to / f"{board.stem}-positions.csv").write_text(
            positions(raw.read_text(encoding="utf-8")), encoding="utf-8"
        )
        raw.unlink()
        shutil.copy(bill_file, to / f"{board.stem}-bom.csv")
        drawing = ("--mode-single", "--black-and-white", "--exclude-value", "--layers", ASSEMBLY)
        kicad(
            "pcb", "export", "pdf", *drawing, "--output", to / f"{board.stem}-assembly.pdf", board
        )
        with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
            for file in sorted(to.iterdir()):
                archive.writestr(
                    zipfile.ZipInfo(file.name, _EPOCH), file.read_bytes(), zipfile.ZIP_DEFLATED
                )


def copper_layers(board: Path) -> list[str]:
    """Names of a layout's layers of copper, from the front."""
    text = board.read_text(encoding="utf-8")
    return re.findall(r'^\t\t\(\d+ "(\S+\.Cu)"', text, re.MULTILINE)


def positions(text: str) -> str:
    """KiCad's table of positions, its columns named as assembly houses name them."""
    out = io.StringIO()
    rows = csv.writer(out, lineterminator="\n")
    rows.writerow(POSITIONS)
    names = ("Ref", "Val", "Package", "PosX", "PosY", "Rot", "Side")
    for row in csv.DictReader(text.splitlines()):
        rows.writerow([row[name] for name in names])
    return out.getvalue()


def sources() -> list[Path]:
    """What outputs are made of."""
    ends = (".kicad_sch", ".kicad_pcb", ".kicad_sym")
    return [*sorted(f for f in KICAD.iterdir() if f.suffix in ends), ROOT / "parts.toml"]


def manifest(outputs: list[Path]) -> str:
    """Hashes of sources and outputs, as TOML."""
    lines = ["# Made by hardware/fabricate.py: SHA-256 of what outputs are made of, and theirs."]
    for title, files in (("sources", sources()), ("outputs", outputs)):
        lines += ["", f"[{title}]"]
        lines += [
            f'"{file.relative_to(ROOT.parent).as_posix()}" = "{_hash(file)}"' for file in files
        ]
    return "\n".join(lines) + "\n"


def stale() -> list[str]:
    """Files that are not those of the manifest: changed, gone, or new."""
    table = tomllib.loads(MANIFEST.read_text(encoding="utf-8"))
    held = table["sources"] | table["outputs"]
    wrong = {
        name
        for name, digest in held.items()
        if not (ROOT.parent / name).is_file() or _hash(ROOT.parent / name) != digest
    }
    return sorted(wrong | ({f.relative_to(ROOT.parent).as_posix() for f in sources()} - set(held)))


def _hash(file: Path) -> str:
    return hashlib.sha256(file.read_bytes()).hexdigest()


def main() -> int:
    """Check, and make all."""
    outputs: list[Path] = []
    try:
        for name in BOARDS:
            check(name)
            print(f"{name}: electrical and design rules, parity: nothing found")
            if sys.argv[1:] != ["--check"]:
                outputs += make(name)
    except BoardError as error:
        print(error, file=sys.stderr)
        return 1
    if outputs:
        MANIFEST.write_text(manifest(outputs), encoding="utf-8")
        print(*(file.relative_to(ROOT.parent) for file in outputs), sep="\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
