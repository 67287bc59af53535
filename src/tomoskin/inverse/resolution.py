"""What an operator can tell: resolution, point spread and sensitivity, without an SVD.

The image of a small change x is RJx (Menke 2018, chapter 4): a column of RJ is the picture of a
change in one cell, a row the changes that add up to one cell of the picture.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import eigvalsh

from tomoskin.core import FloatArray, ModelError
from tomoskin.inverse.operator import Operator
from tomoskin.inverse.problem import LinearProblem

_ROUNDING = 1e-14
"""An eigenvalue of RᴴR below this part of the largest is rounding."""


def resolution_matrix(operator: Operator, problem: LinearProblem) -> NDArray[Any]:
    """RJ, (n_cells, n_cells): as many numbers as that; ask for what you need of it below.

    Raises
    ------
    ModelError
        When operator and problem are not of one mesh, pattern and difference; so below.
    """
    _check_pair(operator, problem)
    return np.asarray(operator.matrix @ problem.jacobian)


def resolved(operator: Operator, problem: LinearProblem) -> NDArray[Any]:
    """(n_cells,) diagonal of RJ: the part of a change in a cell that its own place shows.

    Of a one-step operator the sum is the number of degrees of freedom that the data decide.
    """
    _check_pair(operator, problem)
    return np.asarray(np.einsum("cm,mc->c", operator.matrix, problem.jacobian))


def point_spread(operator: Operator, problem: LinearProblem, cells: ArrayLike) -> NDArray[Any]:
    """(n_cells, k) pictures of a change of 1 in each of ``cells``: columns of RJ."""
    _check_pair(operator, problem)
    return np.asarray(operator.matrix @ problem.jacobian[:, np.asarray(cells)])


def averaging(operator: Operator, problem: LinearProblem, cells: ArrayLike) -> NDArray[Any]:
    """(k, n_cells) weights with which changes enter the picture of each of ``cells``."""
    _check_pair(operator, problem)
    return np.asarray(operator.matrix[np.asarray(cells)] @ problem.jacobian)


def sensitivity(problem: LinearProblem) -> FloatArray:
    """(n_cells,) root of Σ_rows W|J|², per area of the cell, so that meshes can be compared.

    V/S/m² with unit weights on a sheet; what a change of given size and area does to the data.
    """
    power = np.einsum("mc,m,mc->c", problem.jacobian, problem.weights, problem.jacobian.conj())
    return np.asarray(np.sqrt(power.real) / problem.model.mesh.volumes)


def condition_number(operator: Operator) -> float:
    """Largest over least singular value of R: the most that noise can outgrow a change in it.

    From the eigenvalues of RᴴR, so up to 1e7 of what R holds; rows that say the same twice, as
    reciprocal ones do, are counted once. See :attr:`Spectrum.condition` for that of J.
    """
    values = eigvalsh(operator.matrix.conj().T @ operator.matrix)
    kept = values[values > _ROUNDING * values[-1]]
    return float(np.sqrt(kept[-1] / kept[0]))


def _check_pair(operator: Operator, problem: LinearProblem) -> None:
    one, other = operator.model, problem.model
    same = (
        one.mesh.identity == other.mesh.identity
        and one.pattern.identity == other.pattern.identity
        and operator.difference == problem.difference
    )
    if not same:
        raise ModelError(
            "expected operator and problem of one mesh, pattern and kind of difference, got "
            f"{one.mesh.identity}, {one.pattern.identity}, {operator.difference} and "
            f"{other.mesh.identity}, {other.pattern.identity}, {problem.difference}"
        )
