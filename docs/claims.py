"""What is published is what a run gives: docs/claims.toml, the pages, and the runs behind them.

``python docs/claims.py [PART]`` runs the command of each claim of that part, or of all, and fails
where a figure is not what stands in the file. Runs that this code has done already are not repeated
(build/claims keeps them). With ``--accept`` the file takes the new figures, and the gallery the new
pictures. Pages are written from the file each time; ``--check`` only says what is stale there.

A table ``[PART.NAME]`` of the file has a ``command`` that prints JSON, its ``values``, which hold
``within`` a part of themselves, and ``pages`` with the texts that show them: ``{KEY|2}`` is a value
with two decimals. A key of an example is the name of its number; that of a benchmark is
``TITLE > FIRST / CELLS / OF THE ROW → COLUMN``. ``needs`` names public recordings. The figures of
a ``[tables.NAME]`` stand on its ``page`` alone, between ``<!-- bench NAME -->`` and its end: every
number of every table there. Times depend on what else a machine does: figures of its columns
``timed`` hold within a factor of three, and those of its columns ``tails``, which a few slow
messages decide, within ten.
"""

from __future__ import annotations

import argparse
import datetime
import hashlib
import json
import re
import shlex
import subprocess
import sys
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any

from gallery import save_picture, written_gallery
from tomoskin.cli.bench import load_benchmark

ROOT = Path(__file__).resolve().parent.parent
REPORT = load_benchmark("report")
FILE, KEPT = ROOT / "docs" / "claims.toml", ROOT / "build" / "claims"
RECORDINGS = ROOT.parent / "shared" / "data"
CODE = ("src", "core-native", "examples", "benchmarks")

_SLOWER, _TAIL = 3.0, 10.0
"""Times as long, or as short, as published, on a machine that does other things."""

_SLOT = re.compile(r"\{([^{}|]+)\|(\d)\}")
_NUMBER = r"([−-]?\d+(?:,\d{3})*(?:\.\d+)?)"
_HEAD = "# Published figures and the runs that give them: see docs/claims.py, which writes this.\n"


@dataclass(frozen=True)
class Claim:
    """Figures that one command gives."""

    part: str
    name: str
    command: str
    date: datetime.date
    commit: str
    values: Mapping[str, float] = field(default_factory=dict)
    within: float = 0.02
    needs: str = ""
    timed: Sequence[str] = ()
    tails: Sequence[str] = ()
    page: str = ""
    pages: Mapping[str, Sequence[str]] = field(default_factory=dict)

    def broken(self, found: Mapping[str, float]) -> list[str]:
        """Values that are not what was found."""
        if not found:
            return [f"{self.name}: {self.command} failed"]
        new = [key for key in found if self.page and key not in self.values]
        return [f"{self.name}, {key}: is not published" for key in new] + [
            f"{self.name}, {key}: {value:g} is published, {found.get(key)} was found"
            for key, value in self.values.items()
            if key not in found or not self._holds(key, value, found[key])
        ]

    def _holds(self, key: str, value: float, now: float) -> bool:
        for columns, most in ((self.timed, _SLOWER), (self.tails, _TAIL)):
            if any(f"→ {column}," in f"{key}," for column in columns):
                return value * now >= 0 and abs(value) / most <= abs(now) <= abs(value) * most
        return abs(now - value) <= self.within * abs(value)


def claims() -> list[Claim]:
    """All of the file."""
    parts = tomllib.loads(FILE.read_text(encoding="utf-8"))
    every = (Claim(part, name, **one) for part, some in parts.items() for name, one in some.items())
    return [replace(one, values=numbers(on_page(one))) if one.page else one for one in every]


def dumped(every: Sequence[Claim]) -> str:
    """The text of the file."""
    lines = [_HEAD]
    for one in every:
        lines.append(f"[{one.part}.{one.name}]")
        lines += [f'command = "{one.command}"', f"date = {one.date}", f'commit = "{one.commit}"']
        lines += [f"within = {one.within:g}"] * (one.within != Claim.within)
        lines += [f'needs = "{one.needs}"'] * bool(one.needs)
        for name in ("timed", "tails"):
            columns = getattr(one, name)
            lines += [f"{name} = {json.dumps(columns, ensure_ascii=False)}"] * bool(columns)
        if one.page:
            lines += [f'page = "{one.page}"', ""]
            continue
        lines += ["", f"[{one.part}.{one.name}.values]"]
        lines += [f"{_quoted(key)} = {float(f'{value:.4g}')}" for key, value in one.values.items()]
        if one.pages:
            lines += ["", f"[{one.part}.{one.name}.pages]"]
        for page, texts in one.pages.items():
            lines += [f"{_quoted(page)} = [", *(f"  {_quoted(text)}," for text in texts), "]"]
        lines.append("")
    return "\n".join(lines)


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)


def measured(claim: Claim) -> Any:
    """What its command prints; None where recordings are missing, empty where it fails."""
    if claim.needs and not (RECORDINGS / claim.needs).exists():
        return None
    kept = (KEPT / re.sub(r"\W+", "_", claim.command)).with_suffix(".json")
    if kept.is_file() and (before := json.loads(kept.read_text()))["code"] == code():
        return before["document"]
    print(claim.command, file=sys.stderr, flush=True)
    program, *rest = shlex.split(claim.command)
    module = ["-m", "tomoskin"] if program == "tomoskin" else []
    more = ["--out", str(KEPT), "--force"] if claim.part == "gallery" else []
    ended = subprocess.run(
        [sys.executable, *module, *rest, *more, "--json"],
        cwd=ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip
    if ended.returncode:
        print(ended.stderr, file=sys.stderr)
        return {}
    document = json.loads(ended.stdout)
    kept.write_text(json.dumps({"code": code(), "document": document}))
    return document


def figures(claim: Claim, document: Any) -> dict[str, float]:
    """What a run of its command found, by key."""
    if claim.page:
        return numbers(document)
    if claim.part == "gallery":
        return dict(document)
    return {key: value for key in claim.values if (value := read(document, key)) is not None}


def on_page(claim: Claim) -> list[dict[str, Any]]:
    """The reports of a benchmark as they stand on its page."""
    part = REPORT.Part.of(ROOT / claim.page, claim.name)
    reports = []
    for text in part.text.split("\n### ")[1:]:
        title, _, rest = text.partition("\n")
        lines = [line for line in rest.splitlines() if line.startswith("| ")]
        columns, _, *rows = ([cell.strip() for cell in line[1:-1].split(" | ")] for line in lines)
        reports.append({"title": title, "columns": columns, "rows": rows})
    return reports


def numbers(reports: Sequence[Mapping[str, Any]]) -> dict[str, float]:
    """Numbers of the cells by table, row, column and place; the first cell names its row."""
    found = {}
    for report in reports:
        title = report["title"][:1].upper() + report["title"][1:]
        for line, (first, *cells) in enumerate(report["rows"], 1):
            for column, cell in zip(report["columns"][1:], cells, strict=True):
                for place, number in enumerate(_numbers(str(cell)), 1):
                    found[f"{title} > {first} ({line}) → {column}, {place}"] = number
    return found


def _numbers(text: str) -> list[float]:
    plain = (number.replace(",", "").replace("−", "-") for number in re.findall(_NUMBER, text))
    return [float(number) for number in plain]


def read(document: Any, key: str) -> float | None:
    """The number of that key in what a command printed."""
    if isinstance(document, dict):
        return document.get(key)
    title, _, rest = key.rpartition(" > ")
    label, _, column = rest.partition(" → ")
    first = label.split(" / ")
    for report in document:
        for row in report["rows"] if title in report["title"] else ():
            if [str(cell) for cell in row[: len(first)]] == first:
                return _numbers(str(row[report["columns"].index(column)]))[0]
    return None


@cache
def code() -> str:
    """Says which code this is, changes that are not committed included."""
    git = ["git", "-C", str(ROOT)]
    head = subprocess.check_output([*git, "rev-parse", *(f"HEAD:{folder}" for folder in CODE)])
    changes = subprocess.check_output([*git, "diff", "HEAD", "--", *CODE])
    return hashlib.sha256(head + changes).hexdigest()


def written(text: str, template: str, values: Mapping[str, float]) -> str:
    """``text`` of a page, in which the one place of ``template`` shows the ``values``."""
    parts = _SLOT.split(template)
    words = [r"\s+".join(map(re.escape, part.split(" "))) for part in parts[::3]]
    places = list(re.finditer(_NUMBER.join(words), text))
    if len(places) != 1:
        raise ValueError(f"{len(places)} places say: {template}")
    for number in reversed(range(1, len(words))):
        key, digits = parts[3 * number - 2 : 3 * number]
        begin, end = places[0].span(number)
        text = f"{text[:begin]}{values[key]:,.{digits}f}{text[end:]}"
    return text


def pages(every: Sequence[Claim]) -> Iterator[tuple[Path, str]]:
    """Every page that shows claims, and its text by them."""
    texts: dict[Path, str] = {}
    for claim in every:
        for name, templates in claim.pages.items():
            page = ROOT / name
            for template in templates:
                text = texts.get(page) or page.read_text(encoding="utf-8")
                texts[page] = written(text, template, claim.values)
    yield from texts.items()
    yield written_gallery()


def run(every: Sequence[Claim], part: str | None, *, accept: bool) -> Iterator[str]:
    """Run the claims of ``part``, say which do not hold, and write file and pages."""
    KEPT.mkdir(parents=True, exist_ok=True)
    commit = subprocess.check_output(["git", "-C", str(ROOT), "rev-parse", "--short", "HEAD"])
    after = {(one.part, one.name): one for one in every}
    for one in every:
        document = measured(one) if part in {None, one.part} else None
        if document is None:
            continue
        found = figures(one, document)
        free = one.page or one.part == "gallery"  # then the run says which figures there are
        if not (accept and found and (free or one.values.keys() <= found.keys())):
            yield from one.broken(found)
            continue
        today = datetime.date.today()
        values = found if one.part == "gallery" else {**one.values, **found}
        after[one.part, one.name] = replace(
            one, values=values, date=today, commit=commit.decode().strip()
        )
        if one.part == "gallery":
            save_picture(KEPT / f"{one.name}.png")
        if one.page:
            reports = [REPORT.Report(**report) for report in document]
            REPORT.Part.of(ROOT / one.page, one.name).write(reports)
        FILE.write_text(dumped(list(after.values())), encoding="utf-8")  # for what is cut off
    for page, text in pages(claims()):
        page.write_text(text, encoding="utf-8")


def main() -> int:
    """Run, or check."""
    every = claims()
    parser = argparse.ArgumentParser(description="Run what the published figures come from.")
    parts = dict.fromkeys(one.part for one in every)
    parser.add_argument("part", nargs="?", choices=[*parts], help="of the claims; all without it")
    parser.add_argument("--accept", action="store_true", help="publish what is found")
    parser.add_argument("--check", action="store_true", help="run nothing; say what is stale")
    options = parser.parse_args()
    if options.check:
        wrong = [str(page) for page, text in pages(every) if page.read_text("utf-8") != text]
    else:
        wrong = list(run(every, options.part, accept=options.accept))
    print(*wrong, sep="\n", end="\n" if wrong else "", file=sys.stderr)
    return bool(wrong)


if __name__ == "__main__":
    sys.exit(main())
