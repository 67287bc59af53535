"""The gallery of the documentation, made by running the examples that have a figure.

``python docs/make_gallery.py`` runs them, writes their figures and numbers into
docs/images/gallery and the page of them, docs/gallery.md; ``… --check`` says what is stale there.
Below its mark the page holds what stands at the head of each example, its figure and its numbers.
"""

from __future__ import annotations

import ast
import importlib
import json
import re
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path

from PIL import Image, ImageSequence

ROOT = Path(__file__).resolve().parent.parent
EXAMPLES = ROOT / "examples"
IMAGES = ROOT / "docs" / "images" / "gallery"
NUMBERS = IMAGES / "numbers.json"
PAGE = ROOT / "docs" / "gallery.md"
QUALITY, OF_FILM = 85, 70
"""Of WebP: at 85 a line of a pixel stays sharp, and no figure has 60 kB; a film has 200 kB."""

MARK = "<!-- made by make gallery: what follows is not written by hand -->"

FEW = 7
"""Up to so many numbers are shown unasked."""

Numbers = Mapping[str, Mapping[str, float]]


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


def page(numbers: Numbers) -> str:
    """The text of docs/gallery.md, above its mark as it stands."""
    head, mark, _ = PAGE.read_text(encoding="utf-8").partition(MARK)
    entries = [_entry(name, text, numbers[name]) for name, text in documented().items()]
    return "\n".join([f"{head}{mark}\n", *entries])


def _entry(name: str, text: str, numbers: Mapping[str, float]) -> str:
    """One example: what stands at its head, its figure and its numbers."""
    title, _, rest = text.replace("``", "`").partition("\n")
    body, shown, saw, checked = re.split(r"^(?:Shown|Thesis saw|Checked): ", rest, flags=re.M)
    rows = [f"| {key} | {value:.3g} |" for key, value in numbers.items()]
    table = "\n".join(["| number | value |", "|---|---:|", *rows])
    heading = title.strip().rstrip(".")
    details = "<details open>" if len(rows) <= FEW else "<details>"
    return f"""## {heading}

![{heading}](images/gallery/{name}.webp)

*{_capital(_joined(shown))}*

{body.strip()}

**The thesis saw** {_joined(saw)}

**Checked:** {_joined(checked)}

{details}<summary>{len(rows)} numbers of this run</summary>

{table}

</details>

```
python examples/{name}.py --out figures --force
```
"""


def _joined(text: str) -> str:
    return " ".join(text.split())


def _capital(text: str) -> str:
    return text[0].upper() + text[1:]


def make() -> None:
    """Run all examples, and write figures, numbers and the page.

    What rests on recordings that are not here stays as it is.
    """
    sys.path.insert(0, str(EXAMPLES))
    IMAGES.mkdir(parents=True, exist_ok=True)
    before, numbers = json.loads(NUMBERS.read_text(encoding="utf-8")), {}
    with tempfile.TemporaryDirectory() as folder:
        for name in documented():
            print(name, flush=True)
            example = importlib.import_module(name)
            if not getattr(example, "RECORDINGS", EXAMPLES).exists():
                numbers[name] = before[name]
                continue
            found = example.main(["--out", folder])
            numbers[name] = {key: float(f"{value:.4g}") for key, value in found.items()}
            save(Path(folder) / f"{name}.png", IMAGES / f"{name}.webp")
    NUMBERS.write_text(json.dumps(numbers, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    PAGE.write_text(page(numbers), encoding="utf-8")


def save(drawn: Path, shown: Path) -> None:
    """Write a figure, or a film where it has several pictures, as WebP."""
    with Image.open(drawn) as figure:
        pictures = [picture.convert("RGB") for picture in ImageSequence.Iterator(figure)]
        pause = figure.info.get("duration", 0)
    first, *rest = pictures
    if not rest:
        first.save(shown, quality=QUALITY, method=6)
        return
    first.save(
        shown, save_all=True, append_images=rest, duration=pause, loop=0, quality=OF_FILM, method=6
    )


def stale() -> list[str]:
    """What the gallery lacks, holds too much of, or says otherwise than the examples."""
    names = documented()
    numbers = json.loads(NUMBERS.read_text(encoding="utf-8"))
    wrong = [f"{name}: not as in examples" for name in names.keys() ^ numbers.keys()]
    wrong += [f"{name}: no figure" for name in names if not (IMAGES / f"{name}.webp").is_file()]
    if not wrong and PAGE.read_text(encoding="utf-8") != page(numbers):
        wrong.append(f"{PAGE.name}: not what the examples say")
    return wrong


def main() -> int:
    """Make the gallery, or say what is stale in it."""
    if sys.argv[1:] != ["--check"]:
        make()
        return 0
    wrong = stale()
    print(*wrong, sep="\n", end="\n" if wrong else "", file=sys.stderr)
    return bool(wrong)


if __name__ == "__main__":
    sys.exit(main())
