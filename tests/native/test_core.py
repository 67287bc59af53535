"""The extension by itself, against scipy and numpy; hostile input ends in ValueError."""

from __future__ import annotations

import threading
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.sparse import csc_array, csr_array, random_array
from scipy.sparse.linalg import spsolve

import shapes
from conftest import NO_ENGINE
from tomoskin.model.forward import ForwardModel
from tomoskin.model.pattern import Pattern

core = pytest.importorskip("tomoskin_core", reason=NO_ENGINE)

TYPES = [np.float64, np.complex128]


def system(kind: Any, cells: int = 800) -> csc_array:
    """Return a system matrix."""
    model = ForwardModel(shapes.disc(16, cells), Pattern.adjacent(16), contact_impedance=0.02)
    generator = np.random.default_rng(3)
    sigma = generator.uniform(0.5, 2.0, len(model.mesh.cells)).astype(kind)
    if kind is np.complex128:
        sigma += 1j * generator.uniform(-1.0, 1.0, len(sigma))
    return model.assembly.matrix(sigma, model.contacts).matrix


def units(matrix: csc_array, rows: NDArray[np.int64]) -> NDArray[Any]:
    """Return columns of the identity."""
    return np.eye(matrix.shape[0], dtype=matrix.dtype)[:, rows]


def symbolic(matrix: csc_array) -> Any:
    return core.Symbolic(matrix.shape[0], matrix.indptr, matrix.indices)


def jacobian_arguments(n_cells: int = 50) -> list[Any]:
    pattern = Pattern.adjacent(8)
    gradient = np.random.default_rng(0).normal(size=(8, 2, n_cells))
    current = np.ones(pattern.n_drive)
    return [gradient, pattern.drives, current, pattern.drive_index, pattern.measure]


def product_arguments() -> list[Any]:
    matrix = csr_array(np.arange(1.0, 13.0).reshape(4, 3))
    parts = [matrix.indptr.astype(np.int32), matrix.indices.astype(np.int32), matrix.data]
    return [*parts, np.ones((3, 5)), np.zeros((5, 4))]


@pytest.mark.parametrize("kind", TYPES)
@pytest.mark.parametrize("k", [0, 1, 2, 5, 8, 9, 15, 16, 17, 33])
def test_columns_of_the_inverse_are_those_of_scipy(kind: Any, k: int) -> None:
    matrix = system(kind)
    rows = np.random.default_rng(k).integers(matrix.shape[0], size=k)
    factor = symbolic(matrix).factor(matrix.data)
    columns = factor.columns(rows)
    assert columns.shape == (matrix.shape[0], k)
    assert columns.dtype == kind
    assert columns.flags.c_contiguous
    np.testing.assert_array_equal(factor.checked_columns(matrix.data, rows)[0], columns)
    if k:
        expected = spsolve(matrix, units(matrix, rows)).reshape(columns.shape)
        np.testing.assert_allclose(columns, expected, rtol=0, atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize("kind", TYPES)
@pytest.mark.parametrize("k", [1, 8, 9, 16, 33])
def test_what_columns_leave_over_is_that_of_scipy(kind: Any, k: int) -> None:
    """Of a matrix that the factor does not belong to, so that it is more than rounding."""
    matrix = system(kind)
    rows = np.random.default_rng(k).permutation(matrix.shape[0])[:k]
    other = matrix.copy()
    other.data = other.data * 0.75
    factor = symbolic(matrix).factor(matrix.data)
    columns, lost, largest = factor.checked_columns(other.data, rows)
    residual = units(matrix, rows) - other @ columns
    np.testing.assert_allclose(lost, columns.T @ residual, rtol=0, atol=1e-12 * np.abs(lost).max())
    assert largest == pytest.approx(np.abs(residual).max(), rel=1e-12)


def test_rows_and_values_are_checked() -> None:
    matrix = system(np.float64)
    factor = symbolic(matrix).factor(matrix.data)
    for rows in (np.array([-1]), np.array([matrix.shape[0]]), np.array([2**40])):
        with pytest.raises(ValueError, match="rows: expected numbers from 0"):
            factor.columns(rows)
        with pytest.raises(ValueError, match="rows: expected numbers from 0"):
            factor.checked_columns(matrix.data, rows)
    for wrong in (np.array([0.5]), np.zeros((1, 1), np.int64), "text", None):
        with pytest.raises(ValueError, match="rows: expected an array"):
            factor.columns(wrong)
    for values in (matrix.data[1:], matrix.data.astype(complex), matrix.data[None]):
        with pytest.raises(ValueError, match="values"):
            factor.checked_columns(values, np.array([0]))


def test_one_structure_serves_many_factors_in_many_threads() -> None:
    matrix, rows = system(np.float64), np.arange(5, 25)
    analysis = symbolic(matrix)
    solved: dict[int, NDArray[Any]] = {}

    def work(scale: int) -> None:
        solved[scale] = analysis.factor(matrix.data * scale).columns(rows) * scale

    workers = [threading.Thread(target=work, args=(scale,)) for scale in (1, 4, 16, 64)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    for values in solved.values():
        np.testing.assert_array_equal(values, solved[1])  # powers of four are exact


@pytest.mark.parametrize("n", [1, 2, 60])
def test_small_and_diagonal_matrices(n: int) -> None:
    matrix = csc_array((np.arange(1.0, n + 1), np.arange(n), np.arange(n + 1)), shape=(n, n))
    matrix.indices, matrix.indptr = matrix.indices.astype(np.int32), matrix.indptr.astype(np.int32)
    solved = symbolic(matrix).factor(matrix.data).columns(np.arange(n))
    np.testing.assert_allclose(solved, np.diag(1.0 / np.arange(1.0, n + 1)))


@pytest.mark.parametrize("density", [1.0, 0.05, 0.01])
def test_matrices_that_fill_in(density: float) -> None:
    n = 800
    half = random_array((n, n), density=density, rng=np.random.default_rng(0), format="coo")
    matrix = csc_array(half + half.T)
    matrix.setdiag(2.0 * n)
    matrix.sort_indices()
    matrix.indices, matrix.indptr = matrix.indices.astype(np.int32), matrix.indptr.astype(np.int32)
    rows = np.array([3, 700, 12, 0, n - 1])
    solved = symbolic(matrix).factor(matrix.data).columns(rows)
    np.testing.assert_allclose(matrix @ solved, units(matrix, rows), rtol=0, atol=1e-12)


@pytest.mark.parametrize("kind", TYPES)
@pytest.mark.parametrize("value", [np.nan, np.inf, 0.0, -1.0])
def test_what_is_not_positive_definite_is_refused(kind: Any, value: float) -> None:
    matrix = system(kind)
    with pytest.raises(ValueError, match="not positive definite"):
        symbolic(matrix).factor(np.full_like(matrix.data, value))


def test_an_indefinite_matrix_is_refused() -> None:
    matrix = system(np.float64)
    matrix.setdiag(matrix.diagonal() - matrix.diagonal().mean())
    with pytest.raises(ValueError, match="not positive definite"):
        symbolic(matrix).factor(matrix.data)


@pytest.mark.parametrize(
    ("n", "indptr", "indices"),
    [
        (2, [0, 1], [0]),
        (2, [0, 1, 3], [0, 1]),
        (2, [0, 3, 2], [0, 1]),
        (2, [1, 1, 2], [0, 1]),
        (2, [0, 1, 2], [0, 2]),
        (2, [0, 1, 2], [0, -1]),
        (2, [0, 2, 4], [1, 0, 0, 1]),
        (2, [0, 1, 2], [1, 0]),
        (2, [0, 2, 3], [0, 1, 1]),
        (2, [0, 1, 3], [0, 0, 1]),
        (0, [0], []),
        (2**60, [0, 1, 2], [0, 1]),
    ],
)
def test_what_is_no_structure_is_refused(n: int, indptr: list[int], indices: list[int]) -> None:
    with pytest.raises(ValueError, match=r"ind|row|column"):
        core.Symbolic(n, np.array(indptr, np.int32), np.array(indices, np.int32))


def patch_arguments() -> list[Any]:
    """Two triangles of a square, with its corners at the first and the last node held."""
    cells = np.array([[0, 1, 2], [1, 2, 3]])
    local = np.broadcast_to(np.eye(3) - 1 / 3, (2, 3, 3)).copy()
    held = np.array([True, False, False, True])
    return [cells, local, held, np.ones(2), np.arange(8.0).reshape(4, 2), np.eye(2)]


def test_wrong_patches_are_refused() -> None:
    good = patch_arguments()
    core.Patches(*good)
    worse: list[tuple[int, Any]] = [
        (0, np.array([[0, 1, 2], [1, 2, 4]])),
        (0, np.array([[0, 1, 2], [1, 2, -1]])),
        (0, good[0][:1]),
        (1, good[1][:, :2]),
        (2, good[2][:3]),
        (2, np.ones(4)),
        (3, np.ones(3)),
        (3, np.ones(2, complex)),
        (4, np.ones((3, 2))),
        (5, np.eye(3)),
    ]
    for place, value in worse:
        wrong = list(good)
        wrong[place] = value
        with pytest.raises(ValueError, match=r"expected|node"):
            core.Patches(*wrong)


def test_wrong_touches_are_refused() -> None:
    patches, one = core.Patches(*patch_arguments()), np.ones(1)
    starts, cells = np.array([0, 1]), np.array([1])
    assert patches.change(starts, cells, one)[2].tolist() == [1, 2, 3]
    wrong: list[tuple[Any, ...]] = [
        (starts, np.array([2]), one),
        (starts, np.array([-1]), one),
        (starts, cells, -one),
        (starts, cells, one * np.nan),
        (starts, cells, np.ones(2)),
        (np.array([0, 2]), np.array([1, 1]), np.ones(2)),
        (np.array([0, 2]), cells, one),
        (np.array([1, 0, 1]), cells, one),
        (starts[:0], cells, one),
    ]
    for arguments in wrong:
        with pytest.raises(ValueError, match=r"touch 0|expected"):
            patches.change(*arguments)
    with pytest.raises(ValueError, match="rows of columns"):
        patches.keep(np.array([1]), np.ones((3, 1)))
    with pytest.raises(ValueError, match="node"):
        patches.keep(np.array([4]), np.ones((4, 1)))


def test_a_residual_that_is_no_number_stays_none() -> None:
    matrix, rows = system(np.float64), np.array([4, 2])
    values = matrix.data.copy()
    values[5] = np.nan
    factor = symbolic(matrix).factor(matrix.data)
    assert np.isnan(factor.checked_columns(values, rows)[2])


def test_the_vector_code_has_a_name() -> None:
    assert core.vector_code in {"AVX-512", "AVX2", "NEON", "none"}


def test_a_large_jacobian_is_fetched_ahead() -> None:
    gradient, drives, current, drive_index, measure = jacobian_arguments(27_001)
    rows = core.jacobian(gradient, drives, current, drive_index, measure)
    assert rows.nbytes > 8 << 20
    driven = gradient[drives[drive_index, 1]] - gradient[drives[drive_index, 0]]
    read = gradient[measure[:, 0]] - gradient[measure[:, 1]]
    np.testing.assert_allclose(rows, (driven * read).sum(axis=1), rtol=0, atol=1e-12)
    turned = core.jacobian(1j * gradient, drives, current, drive_index, measure)
    np.testing.assert_allclose(turned, -rows, rtol=0, atol=1e-12)


@pytest.mark.skipif(
    not hasattr(core, "Reference"),
    reason="bare faer, for benchmarks only (python scripts/native.py reference)",
)
@pytest.mark.parametrize("cells", [200, 800])
def test_the_reference_solves_what_we_solve(cells: int) -> None:
    matrix, rows = system(np.float64, cells), np.arange(15)
    columns = np.ascontiguousarray(units(matrix, rows).T)
    faer = core.Reference(matrix.shape[0], matrix.indptr, matrix.indices, len(columns))
    for scale in (1.0, 4.0):
        expected = symbolic(matrix).factor(matrix.data * scale).columns(rows)
        solved = faer.solve(matrix.data * scale, columns)
        off = np.abs(solved.T - expected).max()
        assert off <= 1e-12 * np.abs(expected).max()
    for wrong in ((matrix.data[1:], columns), (matrix.data, columns[1:]), (-matrix.data, columns)):
        with pytest.raises(ValueError, match=r"expected|definite"):
            faer.solve(*wrong)


def test_wrong_arrays_are_refused() -> None:
    matrix = system(np.float64)
    analysis = symbolic(matrix)
    bad_values = [matrix.data[1:], matrix.data[None], matrix.data.astype(np.float32), "text", None]
    for values in [*bad_values, np.repeat(matrix.data, 2)[::2]]:
        with pytest.raises(ValueError, match="values"):
            analysis.factor(values)
    with pytest.raises(ValueError, match="indptr"):
        core.Symbolic(matrix.shape[0], matrix.indptr.astype(np.int64), matrix.indices)


@pytest.mark.parametrize("kind", TYPES)
@pytest.mark.parametrize("threads", [None, 1, 2, 3])
@pytest.mark.parametrize("k", [1, 15, 16, 40])
def test_products_are_those_of_scipy(kind: Any, threads: int | None, k: int) -> None:
    generator = np.random.default_rng(k)
    matrix = csr_array(random_array((40_000, 30), density=0.1, rng=generator))
    vectors = generator.normal(size=(30, k)).astype(kind)
    out = np.full((k, 40_000), np.nan, kind)
    parts = (part.astype(np.int32) for part in (matrix.indptr, matrix.indices))
    core.transposed_product(*parts, matrix.data, vectors, out, threads)
    np.testing.assert_allclose(out, (matrix @ vectors).T, rtol=1e-13, atol=1e-14)


@pytest.mark.parametrize(
    ("at", "value"),
    [
        (0, np.array([0, 3, 6, 9], np.int32)),
        (0, np.array([1, 3, 6, 9, 12], np.int32)),
        (0, np.array([0, 6, 3, 9, 12], np.int32)),
        (0, np.zeros(0, np.int32)),
        (1, np.full(11, 2, np.int32)),
        (1, np.full(11, -1, np.int32)),
        (2, np.ones(3)),
        (3, np.ones((2, 5))),
        (3, np.ones(5)),
        (4, np.ones((4, 5))),
        (4, np.ones((5, 4), complex)),
        (4, np.ones((5, 8))[:, ::2]),
    ],
)
def test_products_of_wrong_shape_are_refused(at: int, value: Any) -> None:
    arguments = product_arguments()
    arguments[at] = value
    with pytest.raises(ValueError, match=r"\w"):
        core.transposed_product(*arguments)


def test_a_result_that_may_not_be_written_is_refused() -> None:
    arguments = product_arguments()
    arguments[4].flags.writeable = False
    with pytest.raises(ValueError, match="out"):
        core.transposed_product(*arguments)


@pytest.mark.parametrize("kind", TYPES)
@pytest.mark.parametrize("components", [1, 2, 3, 6])
@pytest.mark.parametrize("threads", [None, 1, 2, 5])
def test_jacobian_rows(kind: Any, components: int, threads: int | None) -> None:
    generator = np.random.default_rng(components)
    n_el, n_cells, n_meas = 7, 9001, 30
    gradient = generator.normal(size=(n_el, components, n_cells)).astype(kind)
    drives, measure = (
        generator.integers(n_el, size=(5, 2)),
        generator.integers(n_el, size=(n_meas, 2)),
    )
    index, current = generator.integers(5, size=n_meas), generator.normal(size=5)
    rows = core.jacobian(gradient, drives, current, index, measure, threads)
    driven = gradient[drives[index, 1]] - gradient[drives[index, 0]]
    read = gradient[measure[:, 0]] - gradient[measure[:, 1]]
    expected = np.einsum("m,mdc,mdc->mc", current[index], driven, read)
    np.testing.assert_allclose(rows, expected, rtol=0, atol=1e-13 * np.abs(expected).max())


@pytest.mark.parametrize(
    ("at", "value"),
    [
        (0, np.zeros((3, 2, 50))),
        (0, np.zeros((8, 100))),
        (0, np.zeros((8, 50, 2)).transpose(0, 2, 1)),
        (1, np.zeros((8, 3), np.int64)),
        (1, np.full((8, 2), -1)),
        (1, np.zeros((8, 2))),
        (2, np.ones(7)),
        (3, np.full(40, 8)),
        (3, np.full(40, -1)),
        (3, np.zeros(39, np.int64)),
        (4, np.full((40, 2), 8)),
        (4, np.full((40, 2), np.iinfo(np.int64).max)),
        (4, np.zeros((40, 1), np.int64)),
    ],
)
def test_jacobians_of_wrong_shape_are_refused(at: int, value: Any) -> None:
    arguments = jacobian_arguments()
    arguments[at] = value
    with pytest.raises(ValueError, match=r"\w"):
        core.jacobian(*arguments)


def test_empty_jacobians() -> None:
    gradient, drives, current, index, measure = jacobian_arguments(0)
    assert core.jacobian(gradient, drives, current, index, measure).shape == (40, 0)
    assert core.jacobian(gradient, drives, current, index[:0], measure[:0]).shape == (0, 0)
    assert not core.jacobian(np.ones((8, 0, 900)), drives, current, index, measure).any()
