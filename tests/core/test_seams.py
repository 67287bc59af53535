"""What extras and other packages register, by name."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from tomoskin.core import DataError, registered, registered_one, seams

MODULE = "def make():\n    return 'made'\n\n\nclass Kind:\n    inner = 'deep'\n"


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An installed package that registers two things, one of them under the name of an extra's."""
    (tmp_path / "mine.py").write_text(MODULE)
    about = tmp_path / "mine-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: mine\nVersion: 1.0\n")
    points = (
        "[tomoskin.commands]\nmine = mine:make\n[tomoskin.calibrations]\ndeep=mine:Kind.inner\n"
    )
    (about / "entry_points.txt").write_text(points)
    monkeypatch.syspath_prepend(tmp_path)
    yield tmp_path
    sys.modules.pop("mine", None)


@pytest.fixture
def extras(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of extras of its own; what was read of the real ones is forgotten meanwhile."""
    root = tmp_path / "extras"
    root.mkdir()
    monkeypatch.setattr(seams, "_tables", lambda: sorted(root.glob(f"*/{seams.TABLE}")))
    seams._of_extras.cache_clear()
    yield root
    seams._of_extras.cache_clear()


def table(extras: Path, name: str, text: str) -> None:
    (extras / name).mkdir()
    (extras / name / seams.TABLE).write_text(text)


@pytest.mark.usefixtures("package")
def test_a_package_registers_by_entry_points():
    entry = registered("commands")["mine"]
    assert (entry.load()(), entry.extra) == ("made", "")
    assert registered_one("calibrations", "deep").load() == "deep"
    assert registered_one("commands", "other") is None


def test_an_extra_registers_by_its_table(extras):
    table(
        extras, "dust", '[sinks]\ndust = "out:open_dust"\n[commands]\n"skin dust" = "command:dust"'
    )
    entry = registered_one("sinks", "dust")
    assert (entry.target, entry.extra) == ("tomoskin.extras.dust.out:open_dust", "dust")
    assert registered("commands")["skin dust"].target == "tomoskin.extras.dust.command:dust"
    assert seams.extra_names() == ("dust",)


@pytest.mark.usefixtures("package")
def test_an_extra_goes_before_a_package_of_that_name(extras):
    table(extras, "dust", '[commands]\nmine = "command:dust"\n')
    assert registered("commands")["mine"].extra == "dust"


def test_a_section_that_is_no_seam_is_named(extras):
    table(extras, "dust", "[sink]\n")
    with pytest.raises(DataError, match=r'dust.extra\.toml: expected a seam among .*, got "sink"'):
        registered("sinks")


def test_every_registered_thing_can_be_loaded():
    for seam in ("sources", "sinks", "readers", "exports", "calibrations", "commands", "flows"):
        for entry in registered(seam).values():
            assert entry.load() is not None, entry
