"""What may be written where: links, case, folders, sessions, and what a person has said."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from hypothesis import given, strategies as st

from tomoskin.core import RECORDING, Output, OutputError, check_outputs
from tomoskin.core.user_files import MAGIC, is_same_file

NAMES = st.text("abAB.", min_size=1, max_size=4).filter(lambda name: name.strip("."))


@pytest.fixture
def mine(tmp_path: Path) -> Path:
    path = tmp_path / "mine.npz"
    path.write_bytes(b"mine")
    return path


def refusal(*outputs: Output, inputs: tuple[Path, ...] = (), overwrite: bool = False) -> str:
    with pytest.raises(OutputError) as caught:
        check_outputs(outputs, inputs, overwrite=overwrite, consent="--force")
    assert caught.value.hint
    return str(caught.value)


def test_a_new_file_in_a_folder_that_is_there(tmp_path: Path, mine: Path) -> None:
    check_outputs([Output(tmp_path / "new.csv"), Output(tmp_path / "new.png")], [mine])
    assert sorted(tmp_path.iterdir()) == [mine]


def test_what_is_there_is_written_over_only_when_that_was_said(mine: Path) -> None:
    said = refusal(Output(mine, name="--out"))
    assert said == (f"--out {mine}: exists already (choose another name, or overwrite it: --force)")
    check_outputs([Output(mine)], overwrite=True)


@pytest.mark.parametrize("how", ["itself", "relative", "symlink", "hard link", "case", "dots"])
def test_an_input_is_never_written_over(
    tmp_path: Path, mine: Path, how: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "sub").mkdir()
    other = tmp_path / "other.npz"
    match how:
        case "itself":
            other = mine
        case "relative":
            other = Path("mine.npz")
        case "symlink":
            other.symlink_to(mine)
        case "hard link":
            other.hardlink_to(mine)
        case "case":
            other = tmp_path / "MINE.npz"
        case "dots":
            other = tmp_path / "sub" / ".." / "mine.npz"
    said = refusal(Output(other), inputs=(tmp_path / "none", mine), overwrite=True)
    assert "and an input is never overwritten" in said
    assert refusal(Output(mine), inputs=(other,), overwrite=True)


@pytest.mark.parametrize("spelling", ["x.csv", "./x.csv", "X.CSV", "sub/../x.csv"])
def test_two_outputs_are_two_files(
    tmp_path: Path, spelling: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Though neither is there; some disks do not tell case."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "sub").mkdir()
    outputs = (Output(Path("x.csv"), name="--out"), Output(Path(spelling), name="--touches"))
    assert refusal(*outputs, overwrite=True) == (
        f"--touches {Path(spelling)}: is the same file as --out x.csv (give each its own name)"
    )


@given(NAMES, NAMES)
def test_files_that_are_not_there_are_told_apart_by_name(one: str, other: str) -> None:
    folder = Path("no-such-folder")
    same = is_same_file(folder / one, folder / other)
    assert same == is_same_file(folder / other, folder / one)
    assert same == (one.lower() == other.lower())
    assert not is_same_file(folder / one, folder / "deeper" / one)


@pytest.mark.parametrize("name", ["run.mcap", "RUN.MCAP", "run.npz", "run"])
@pytest.mark.parametrize("overwrite", [True, False])
def test_a_recording_is_never_written_over(tmp_path: Path, name: str, overwrite: bool) -> None:
    """Known by its ending, even if it is damaged, or by how it begins."""
    path = tmp_path / name
    path.write_bytes(b"torn" if path.suffix.lower() in RECORDING else MAGIC + b"more")
    link = tmp_path / "link.csv"
    link.symlink_to(path)
    for named in (path, link) if path.read_bytes() != b"torn" else (path,):
        assert "a recording is never overwritten" in refusal(Output(named), overwrite=overwrite)


def test_what_is_no_file_is_refused(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.csv")
    assert "got a folder" in refusal(Output(tmp_path), overwrite=True)
    assert "got a device or pipe" in refusal(Output(tmp_path / "pipe.csv"), overwrite=True)


def test_the_ending_says_what_is_given(tmp_path: Path) -> None:
    endings = {".png": "a picture", "": "a folder"}
    check_outputs([Output(tmp_path / "x.PNG", endings), Output(tmp_path / "x", endings)])
    said = refusal(Output(tmp_path / "x.jpg", endings))
    assert "a name that ends in .png (a picture), no ending (a folder), got x.jpg" in said


def test_the_folder_is_there_and_may_be_written_in(
    tmp_path: Path, mine: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    deep = tmp_path / "a" / "b" / "x.csv"
    assert "there is no folder" in refusal(Output(deep))
    assert "create the folder first" in refusal(Output(deep))
    check_outputs([Output(deep, makes_folders=True)])
    assert "is not a folder" in refusal(Output(mine / "x.csv"))
    assert "is not a folder" in refusal(Output(mine / "sub" / "x.csv", makes_folders=True))
    (tmp_path / "lost").symlink_to(tmp_path / "gone" / "x.csv")
    assert "there is no folder" in refusal(Output(tmp_path / "lost"))
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    assert "cannot be read" in refusal(Output(tmp_path / "loop"))
    assert "cannot be read" in refusal(Output(tmp_path / f"{'x' * 300}.csv"))
    monkeypatch.setattr(os, "access", lambda path, mode: mode & os.X_OK == 0)  # noqa: ARG005
    assert "you have no permission to write in" in refusal(Output(tmp_path / "x.csv"))
    monkeypatch.setattr(os, "access", lambda path, mode: False)  # noqa: ARG005
    assert "write-protected" in refusal(Output(mine), overwrite=True)


def test_where_the_folder_that_we_are_in_is_gone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    gone = tmp_path / "gone"
    gone.mkdir()
    monkeypatch.chdir(gone)
    gone.rmdir()
    assert "x.csv: cannot be read" in refusal(Output(Path("x.csv")))
    check_outputs([Output(tmp_path / "x.csv")])
