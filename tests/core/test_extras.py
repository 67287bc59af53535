"""What a person is told to install where a package is missing."""

from __future__ import annotations

import sys
from importlib.metadata import PackageNotFoundError

import pytest

from tomoskin.core import extras, install_hint


def test_it_names_this_python_and_the_packages_of_the_extra() -> None:
    hint = install_hint("plot")
    assert hint.startswith(f"{sys.executable} -m pip install ")
    assert '"matplotlib>=' in hint


def test_a_path_with_a_space_is_quoted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "executable", "C:\\My Programs\\python.exe")
    assert install_hint("plot").startswith('"C:\\My Programs\\python.exe" -m pip')


def test_each_extra_has_packages_and_none_is_another_s() -> None:
    assert '"h5py' in install_hint("hdf5")
    assert "matplotlib" not in install_hint("hdf5")


def test_without_metadata_it_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    def none(_name: str) -> None:
        raise PackageNotFoundError

    monkeypatch.setattr(extras, "requires", none)
    assert install_hint("plot").endswith('pip install "tomoskin[plot]"')
