"""The tank of the Kuopio challenge: its score, its files, and targets found in it."""

from __future__ import annotations

import importlib.util
import sys
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat

from tomoskin.core import DataError, OutputError
from tomoskin.model.forward import ForwardModel
from tomoskin.model.mesh import Disc, ElectrodeArc, triangulate

pytest.importorskip("tomoskin.extras.absolute", reason="it uses an extra that is not here")

FILE = Path(__file__).resolve().parents[2] / "examples" / "ktc2023.py"
LEVELS = range(1, 8)


@pytest.fixture(scope="session")
def ktc() -> Any:
    """The example, which is a single file and needs nothing beside it."""
    spec = importlib.util.spec_from_file_location("ktc2023", FILE)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["ktc2023"] = module  # dataclasses look themselves up
    spec.loader.exec_module(module)
    return module


def tables() -> tuple[np.ndarray, np.ndarray]:
    """Injections between every second electrode, to the next one and to electrode 0; mA."""
    pairs = [(k, (k + 2) % 32) for k in range(0, 32, 2)] + [(k, 0) for k in range(4, 29, 2)]
    pairs += [(k, 16) for k in range(2, 31, 2) if k not in (0, 14, 16, 18)]
    inj, mpat = np.zeros((32, len(pairs))), np.zeros((32, 31))
    for column, (source, sink) in enumerate(pairs):
        inj[[source, sink], column] = 1.5, -1.5
    mpat[np.arange(31), np.arange(31)], mpat[np.arange(1, 32), np.arange(31)] = 1.0, -1.0
    return inj, mpat


def picture() -> np.ndarray:
    """A resistive square at the upper left, a conductive disc to the right; row 0 at the top."""
    row, column = np.mgrid[:256, :256]
    labels = np.zeros((256, 256), np.uint8)
    labels[(abs(row - 80) < 32) & (abs(column - 85) < 32)] = 1
    labels[np.hypot(row - 150, column - 190) < 30] = 2
    return labels


@cache
def tank(water: float = 0.8, leak: float = 0.02) -> tuple[np.ndarray, np.ndarray]:
    """Voltages with and without the targets, from a finer tank with faults of its own."""
    rng = np.random.default_rng(0)
    rim = Disc(0.115)
    arcs = [ElectrodeArc.around((0.25 + k / 32) * rim.length, 0.0125) for k in range(32)]
    mesh = triangulate(rim, arcs, 5000, seed=3)
    inj, mpat = tables()
    x, y = mesh.centroids.T / 0.115
    kind = picture()[((1 - y) * 128).astype(int), ((1 + x) * 128).astype(int)]
    model = _resistances(mesh, np.exp(rng.normal(np.log(3e-4), 0.7, 32)))
    channel = rng.normal(0.0, leak, 31)
    both = []
    for sigma in (0.98 * water * np.array([1.0, 0.01, 100.0])[kind], water):
        at = model.solve(sigma).electrode_potentials
        reads, sink = at @ mpat, np.take_along_axis(at, inj.argmin(axis=0)[:, None], 1)
        both.append((reads + channel * (at @ np.abs(mpat) / 2 - sink)).ravel())
    u, u_ref = both
    change = (u - u_ref) * (1.0 + 0.02 * rng.standard_normal(len(u)))
    return u_ref + change + 5e-4 * rng.standard_normal(len(u)), u_ref


def _resistances(mesh: Any, contact: np.ndarray) -> ForwardModel:
    from tomoskin.model.pattern import Pattern

    inj, mpat = tables()
    drives = np.column_stack([inj.argmax(axis=0), inj.argmin(axis=0)])
    pairs = np.column_stack([mpat.argmax(axis=0), mpat.argmin(axis=0)])
    return ForwardModel(
        mesh, Pattern.from_pairs(32, drives, pairs, include_driven=True), contact, 1.5
    )


# The score.


def test_the_truth_scores_one_and_water_only_half_for_an_absent_kind(ktc: Any) -> None:
    truth = picture()
    assert ktc.score(truth, truth) == pytest.approx(1.0)
    one_kind = np.where(truth == 1, 1, 0)
    assert ktc.score(np.zeros_like(truth), one_kind) == pytest.approx(0.5, abs=0.01)
    assert ktc.score(np.zeros_like(truth), np.zeros_like(truth)) == pytest.approx(1.0)


def test_the_score_falls_with_distance(ktc: Any) -> None:
    truth = picture()
    moved = [ktc.score(np.roll(truth, by, axis=0), truth) for by in (0, 4, 16, 48)]
    assert moved == sorted(moved, reverse=True)
    assert moved[3] < 0.6 < moved[1]


def test_the_score_is_the_sum_that_defines_it(ktc: Any) -> None:
    """At one pixel, by the book: Gaussian weights over the whole picture."""
    one, other = picture() == 1, np.roll(picture() == 1, 9, axis=1)
    row, column = np.mgrid[:256, :256]
    total = []
    for r, c in ((128, 128), (0, 0), (200, 30)):
        near = (abs(row - r) <= 160) & (abs(column - c) <= 160)
        w = np.exp(-((row - r) ** 2 + (column - c) ** 2) / (2 * 80.0**2)) * near
        w /= w.sum()
        ma, mb = (w * one).sum(), (w * other).sum()
        va, vb = (w * one).sum() - ma**2, (w * other).sum() - mb**2
        both = (w * (one & other)).sum() - ma * mb
        total.append(
            (2 * ma * mb + 1e-4) * (2 * both + 9e-4) / (ma**2 + mb**2 + 1e-4) / (va + vb + 9e-4)
        )
    every = ktc.similarity(one, other)
    assert [every[128, 128], every[0, 0], every[200, 30]] == pytest.approx(total, rel=1e-9)


# Simulated tanks.


@pytest.mark.parametrize(
    ("level", "least"), [(1, 0.85), pytest.param(5, 0.75, marks=pytest.mark.slow)]
)
def test_targets_of_a_simulated_tank_are_found(ktc: Any, level: int, least: float) -> None:
    inj, mpat = tables()
    labels = ktc.segment(*tank(), inj, mpat, ktc.kept(inj, mpat, level))
    assert (labels.shape, labels.dtype) == ((256, 256), np.uint8)
    assert ktc.score(labels, picture()) > least


def test_specks_become_water(ktc: Any) -> None:
    labels = picture()
    labels[10:24, 120:134] = 2
    labels[60:64, 84:88] = 0  # a hole in the square is none of these
    kept = ktc.without_specks(labels)
    assert not kept[10:24, 120:134].any()
    assert np.array_equal(kept[30:], labels[30:])


def test_faults_of_the_read_out_are_found(ktc: Any) -> None:
    inj, mpat = tables()
    readout, _, u_ref = ktc.checked(*tank(), inj, mpat, None)
    _, leak, sigma = ktc.calibrate(readout, u_ref)
    rng = np.random.default_rng(0)
    rng.normal(0.0, 1.0, 32)
    assert leak == pytest.approx(rng.normal(0.0, 0.02, 31), abs=2e-3)
    assert sigma == pytest.approx(0.8, rel=0.01)


@pytest.mark.slow
def test_rows_that_are_not_finite_do_not_count(ktc: Any) -> None:
    inj, mpat = tables()
    u, u_ref = tank()
    keep = ktc.kept(inj, mpat, 6)
    expected = ktc.segment(u, u_ref, inj, mpat, keep)
    hidden = np.where(keep, u, np.nan)
    assert np.array_equal(ktc.segment(hidden, u_ref, inj, mpat), expected)


def test_the_linear_method_finds_something(ktc: Any) -> None:
    inj, mpat = tables()
    labels = ktc.linear(*tank(), inj, mpat)
    assert ktc.score(np.zeros_like(labels), picture()) < ktc.score(labels, picture()) < 0.9


# Files and bad input.


def test_files_of_the_challenge(ktc: Any, tmp_path: Path) -> None:
    inj, mpat = tables()
    u, u_ref = tank()
    column = {"Inj": inj, "Mpat": mpat}
    savemat(tmp_path / "ref.mat", {"Injref": inj, "Uelref": u_ref[:, None], "Mpat": mpat})
    savemat(tmp_path / "data1.mat", {**column, "Uel": u[:, None]})
    truth = tmp_path / "truth"
    truth.mkdir()
    savemat(truth / "true1.mat", {"truth": picture()})
    (sample,) = ktc.samples(tmp_path, truth)
    assert (sample.name, sample.truth.shape) == ("data1", (256, 256))
    assert np.array_equal(sample.u, u)
    assert np.array_equal(sample.u_ref, u_ref)
    figure = tmp_path / "found.png"
    arguments = [str(tmp_path), "--truth", str(truth), "--level", "4", "--figure", str(figure)]
    (result,) = ktc.main(arguments)
    assert result.scores[0] > max(result.scores[1:])
    assert figure.read_bytes().startswith(b"\x89PNG")
    data = tmp_path / "data1.mat"
    for refused, said in ((figure, "--force"), (data, "an input is never overwritten")):
        with pytest.raises(OutputError, match=said):
            ktc.main([*arguments[:-1], str(refused)])


@pytest.mark.parametrize(
    ("files", "message"),
    [
        ({}, "expected ref.mat and data1.mat"),
        ({"ref.mat": {"Uelref": np.ones(3)}}, "expected ref.mat and data1.mat"),
        ({"ref.mat": {"x": 1.0}, "data1.mat": {"Uel": np.ones(3)}}, "expected Uelref or Uel"),
        ({"ref.mat": {"Uelref": 1.0}, "data1.mat": {"Uel": 1.0}}, "data1.mat: expected Inj"),
        ({"ref.mat": {"Uelref": "x"}, "data1.mat": {"Uel": 1.0}}, "ref.mat, Uelref: expected real"),
    ],
)
def test_folders_that_lack_something(
    ktc: Any, tmp_path: Path, files: dict[str, dict[str, Any]], message: str
) -> None:
    for name, arrays in files.items():
        savemat(tmp_path / name, arrays)
    with pytest.raises(DataError, match=message):
        list(ktc.samples(tmp_path))


@pytest.mark.parametrize("held", [b"", b"not one", b"MATLAB 5.0 MAT-file" + 200 * b"\x07"])
def test_files_that_are_no_mat_files(ktc: Any, tmp_path: Path, held: bytes) -> None:
    for name in ("ref.mat", "data1.mat", "all.npz"):
        (tmp_path / name).write_bytes(held)
    with pytest.raises(DataError, match=r"ref.mat: is not a .mat file"):
        list(ktc.samples(tmp_path))
    with pytest.raises(DataError, match=r"all.npz: is not an .npz"):
        list(ktc.samples(tmp_path / "all.npz"))


def test_an_archive_that_lacks_something(ktc: Any, tmp_path: Path) -> None:
    np.savez(tmp_path / "all.npz", U=np.ones((1, 3)), U_ref=np.ones(3))
    with pytest.raises(DataError, match=r"expected inj, got \['U', 'U_ref'\]"):
        list(ktc.samples(tmp_path / "all.npz"))


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"inj": np.ones((16, 3))}, r"expected inj of shape \(32, n\), got \(16, 3\)"),
        ({"mpat": np.ones(32)}, r"expected mpat of shape \(32, n\), got \(32,\)"),
        ({"u": np.ones(5)}, "got 5 of u"),
        ({"u": np.full(5, "x")}, "u: expected real numbers, got <U1"),
        ({"keep": np.ones(5, bool)}, "5 of keep"),
        ({"u": np.nan}, "no row counts"),
    ],
)
def test_arrays_that_do_not_fit(ktc: Any, changed: dict[str, Any], message: str) -> None:
    inj, mpat = tables()
    n = inj.shape[1] * 31
    given = {"u": np.ones(n), "u_ref": np.ones(n), "inj": inj, "mpat": mpat, "keep": None}
    given |= {k: np.full(n, v) if np.ndim(v) == 0 else v for k, v in changed.items()}
    with pytest.raises(DataError, match=message):
        ktc.segment(**given)


# The challenge's own data.


@pytest.fixture(scope="session")
def training(ktc: Any, data_dir: Path) -> list[Any]:
    return list(ktc.samples(data_dir / "ktc2023_tank32" / "train.npz"))


@pytest.mark.data
def test_rows_of_each_level_are_those_of_the_challenge(
    training: list[Any], ktc: Any, data_dir: Path
) -> None:
    with np.load(data_dir / "ktc2023_tank32" / "train.npz") as arrays:
        for level in LEVELS:
            rows = ktc.kept(training[0].inj, training[0].mpat, level)
            assert np.array_equal(rows, arrays["keep_level"][level - 1])


@pytest.mark.data
@pytest.mark.parametrize(
    ("level", "least"), [pytest.param(1, 0.90, marks=pytest.mark.slow), (7, 0.75)]
)
def test_a_target_of_the_challenge(training: list[Any], ktc: Any, level: int, least: float) -> None:
    result = ktc.scored(training[0], level)
    ours, linear, water = result.scores
    assert ours > least
    assert ours > linear > water
