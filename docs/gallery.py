"""The gallery's page: each example's picture, and what stands below its set-up at its head."""

from __future__ import annotations

import ast
import re
from pathlib import Path

from PIL import Image, ImageSequence

ROOT = Path(__file__).resolve().parent.parent
EXAMPLES = ROOT / "examples"
IMAGES = ROOT / "docs" / "images" / "gallery"
PAGE = ROOT / "docs" / "gallery.md"
QUALITIES, OF_FILM, LARGEST = (85, 70, 55, 40), 70, 60_000
"""Of WebP: at 85 a line of a pixel stays sharp; a figure has at most so many bytes."""

MARK = "<!-- made by make gallery: what follows is not written by hand -->"


def documented() -> dict[str, str]:
    """Docstring of each example with a figure, by name, in the order of their figures."""
    found = {}
    for file in sorted(EXAMPLES.glob("*.py"), key=_place):
        text = ast.get_docstring(ast.parse(file.read_text(encoding="utf-8"))) or ""
        if "Shown:" in text:
            found[file.stem] = text
    return found


def _place(file: Path) -> tuple[bool, str, int, str]:
    """Figures by chapter and number, the rest behind them by name."""
    numbered = re.match(r"fig(\d)(\d+)_", file.name)
    chapter, number = numbered.groups() if numbered else ("", "0")
    return numbered is None, chapter, int(number), file.name


def written_gallery() -> tuple[Path, str]:
    """The page, and its text: above its mark as it stands."""
    head, mark, _ = PAGE.read_text(encoding="utf-8").partition(MARK)
    entries = [_entry(name, text) for name, text in documented().items()]
    return PAGE, "\n".join([f"{head}{mark}\n", *entries])


def _entry(name: str, text: str) -> str:
    """One example: its figure, and what stands at its head below the set-up."""
    title, _, rest = text.replace("``", "`").partition("\n")
    parts = re.split(r"^(?:Shown|Thesis saw|Checked|Assumed): ", rest, flags=re.M)
    _, shown, saw, checked, assumed = map(_joined, parts)
    heading = title.strip().rstrip(".")
    return f"""## {heading}

![{heading.partition(":")[0]}](images/gallery/{name}.webp)

*{_capital(shown)}* (`examples/{name}.py`)

**The thesis saw** {saw}

**Checked:** {checked}

**Assumed:** {assumed}
"""


def _joined(text: str) -> str:
    return " ".join(text.split())


def _capital(text: str) -> str:
    return text[0].upper() + text[1:]


def save_picture(drawn: Path) -> None:
    """Keep a figure, or a film where it has several pictures, as WebP."""
    shown = IMAGES / f"{drawn.stem}.webp"
    with Image.open(drawn) as figure:
        pictures = [picture.convert("RGB") for picture in ImageSequence.Iterator(figure)]
        pause = figure.info.get("duration", 0)
    first, *rest = pictures
    if not rest:
        for quality in QUALITIES:
            first.save(shown, quality=quality, method=6)
            if shown.stat().st_size < LARGEST:
                return
        return
    first.save(
        shown, save_all=True, append_images=rest, duration=pause, loop=0, quality=OF_FILM, method=6
    )
