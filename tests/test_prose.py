"""The documentation reads as plain English, and what it names exists."""

from __future__ import annotations

import re
import shlex
from collections import Counter
from collections.abc import Iterable
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from typer.main import get_command

from messages import HOLE, messages, messages_in
from prose import DOCS, PAGES, ROOT, Sentence, helps, sentences, sentences_of
from tomoskin.cli.app import app

MOST_WORDS, MOST_WORDS_OF_HELP, MOST_WORDS_OF_MESSAGE = 40, 26, 30
OLD_WORDS_YET = ("docs/glossary.md",)
"""The page that lists the words of its last table."""

AMERICAN = re.compile(
    r"\b(?:colors?|centers?|centered|behaviors?|neighbors?|meters|gray|\w{4,}(?:yze|yzed|yzing)"
    r"|(?:normal|minim|maxim|factor|regular|discret|optim|recogn|organ|initial|synchron|summar)"
    r"iz(?:e|es|ed|ing|ation|ations|er|ers)|learned|modeling|labeled)\b"
)
NAMES = ("Regularization Tools", "regularized imaging")
"""Of other people's programs and papers."""


def glossary() -> list[str]:
    """Words that the glossary replaces."""
    page = (DOCS / "glossary.md").read_text(encoding="utf-8")
    table = page.partition("## Not these words")[2]
    rows = re.findall(r"^\| (.+?) \| .+ \|$", table, re.MULTILINE)[1:]
    return [word.strip() for row in rows for word in row.split(",") if "---" not in word]


NOT_IN_MESSAGES = (
    *("told", "tells", "goes on", "stands", "asked for", "is to be", "written over", "look at"),
    *("blamed", "wavers", "is no", "are no"),
)
"""Beside the glossary's: old habits of our messages. "There is no" is English."""

_NUMBERED = re.compile(
    rf"\b[Ee]lectrode \(?[{HOLE}\d]|\belectrodes?(?: numbers)? from 0(?! \(E1\))"
)
"""Files and Python count electrodes from 0; people read E1."""

_GOT = re.compile(r"\b(?:got|found|but|missing|is too few|holds?)\b")


@cache
def said() -> tuple[Sentence, ...]:
    """Sentences of errors, hints, events and settings; files' schemas have lines."""
    found = ((where, text) for where, text in messages() if "\n" not in text.strip())
    return tuple(sentence for where, text in found for sentence in sentences_of(text, where))


@cache
def read() -> tuple[Sentence, ...]:
    prose = [sentence for page in PAGES for sentence in sentences(page)]
    return (*prose, *(sentence for name, text in helps() for sentence in sentences_of(text, name)))


def long_ones(limit: int, found: tuple[Sentence, ...]) -> list[Sentence]:
    return [sentence for sentence in found if len(sentence.words) > limit]


def test_no_sentence_is_too_long() -> None:
    pages = tuple(s for s in read() if s.where.endswith(".md"))
    counts = Counter(sentence.where for sentence in long_ones(MOST_WORDS, pages))
    assert counts == {}, [s.text for s in long_ones(MOST_WORDS, pages)]


def test_no_sentence_of_a_command_s_help_is_too_long() -> None:
    of_help = tuple(s for s in read() if not s.where.endswith(".md"))
    assert len(of_help) > 150
    assert long_ones(MOST_WORDS_OF_HELP, of_help) == []


@pytest.mark.parametrize("word", glossary())
def test_a_word_that_the_glossary_replaces_is_not_used(word: str) -> None:
    pattern = re.compile(rf"\b{re.escape(word)}\b", re.IGNORECASE)
    assert [s for s in read() if s.where not in OLD_WORDS_YET and pattern.search(s.text)] == []


def old_words(found: tuple[Sentence, ...]) -> list[Sentence]:
    """Messages with a word that the glossary replaces, or an old habit."""
    words = "|".join(map(re.escape, (*glossary(), *NOT_IN_MESSAGES)))
    pattern = re.compile(rf"(?<!there )\b(?:{words})\b", re.IGNORECASE)
    return [sentence for sentence in found if pattern.search(sentence.text)]


def without_found(found: tuple[Sentence, ...]) -> list[Sentence]:
    """Messages that say what was expected, but not what was found."""
    expecting = (s for s in found if re.match(r"(row …: )?expected ", s.text))
    return [s for s in expecting if not _GOT.search(s.text)]


def test_messages_are_short_plain_and_say_what_was_found() -> None:
    assert len(said()) > 1500
    assert long_ones(MOST_WORDS_OF_MESSAGE, said()) == []
    assert old_words(said()) == []
    assert without_found(said()) == []


def numbered(found: Iterable[str]) -> list[str]:
    """Messages that name an electrode by a number, or a range from 0 without its E1."""
    return [text for text in found if _NUMBERED.search(text)]


def test_electrodes_are_e1_in_every_message() -> None:
    assert numbered(text for _, text in messages(least=2)) == []
    assert numbered(sentence.text for sentence in read()) == []


def test_the_spelling_is_british() -> None:
    found = [s for s in (*read(), *said()) if AMERICAN.search(_without_names(s.text))]
    assert found == []


def _without_names(text: str) -> str:
    text = re.sub(r"`[^`]*`", "", text)
    for name in NAMES:
        text = text.replace(name, "")
    return text


def anchors(page: Path) -> set[str]:
    """As Sphinx and GitHub make them of headings."""
    found = set()
    for heading in re.findall(r"^#+ (.+)$", page.read_text(encoding="utf-8"), re.MULTILINE):
        text = re.sub(r"[`*]|\[([^\]]*)\]\([^)]*\)", r"\1", heading).lower()
        found.add(re.sub(r"[^\w\- ]", "", text).replace(" ", "-"))
    return found


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.relative_to(ROOT).as_posix())
def test_links_lead_somewhere(page: Path) -> None:
    text = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.S | re.M)
    dead = []
    for link in re.findall(r"\]\(([^)\s]+)\)|^\[[^\]]+\]: (\S+)$", text, re.MULTILINE):
        target, _, anchor = (link[0] or link[1]).partition("#")
        if ":" in target:
            continue
        file = (page.parent / target) if target else page
        if not file.exists() or (anchor and file.suffix == ".md" and anchor not in anchors(file)):
            dead.append(link[0] or link[1])
    assert dead == []


def commands_in(text: str) -> list[list[str]]:
    """Words of every ``tomoskin …`` in blocks and in code."""
    blocks = re.findall(r"^```(?:sh|)\n(.*?)^```", text, re.DOTALL | re.MULTILINE)
    lines = [line for block in blocks for line in block.splitlines()]
    lines += re.findall(r"`([^`\n]+)`", re.sub(r"^```.*?^```", "", text, flags=re.S | re.M))
    lines = [line.partition("  #")[0].strip() for line in lines]
    named = [line.removeprefix(".venv/bin/") for line in lines]
    return [shlex.split(line)[1:] for line in named if re.match(r"tomoskin [a-z]", line)]


def fault(words: list[str]) -> str:
    """What of a command does not exist, or ""."""
    command: Any = get_command(app)
    known: set[str] = {"--help"}
    for word in words:
        if word.startswith("--"):
            if word.partition("=")[0] not in known:
                return word
        elif hasattr(command, "list_commands") and "|" not in word and word != "…":
            if (command := command.get_command(None, word)) is None:
                return word
            known |= {option for parameter in command.params for option in parameter.opts}
    return ""


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.relative_to(ROOT).as_posix())
def test_commands_and_their_options_exist(page: Path) -> None:
    found = commands_in(page.read_text(encoding="utf-8"))
    assert {" ".join(words): fault(words) for words in found if fault(words)} == {}


# The checkers, on planted mistakes.


def test_planted_mistakes_are_found() -> None:
    assert fault(["imagine", "x.mcap"]) == "imagine"
    assert fault(["image", "x.mcap", "--loud"]) == "--loud"
    assert fault(["session", "mend", "x"]) == "mend"
    assert fault(["image", "x.mcap", "--out", "a.png"]) == ""
    assert commands_in("`tomoskin skin list` and `tomoskin` alone") == [["skin", "list"]]
    assert commands_in("```\ntomoskin live --port 1   # why\n```\n") == [["live", "--port", "1"]]
    long = " ".join(["word"] * 41)
    (one, two) = sentences_of(f"Short. Then a [{long}](x.md) `code that counts not`.", "x")
    assert (len(one.words), len(two.words)) == (1, 43)
    assert AMERICAN.search("the colors of a normalized image")
    bad = 'raise E(f"expected {n} rows")\nx.say("kind", "nobody has told it")\n"""Told anew."""'
    planted = tuple(Sentence(str(line), text) for line, text in messages_in(bad))
    assert [s.text for s in old_words(planted)] == ["nobody has told it"]
    assert [s.text for s in without_found(planted)] == ["expected … rows"]
    planted_names = ["electrode …: is cut", "E… is cut", "electrodes from 0 to …", "from 0 (E1)"]
    assert numbered(planted_names) == [planted_names[0], planted_names[2]]
    assert not AMERICAN.search(_without_names("`color` in Regularization Tools"))
