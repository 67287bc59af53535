"""The Cramér–Rao bound of a touch's position: no unbiased estimate from one frame is better."""

from __future__ import annotations

import numpy as np

from tomoskin.core import FloatArray
from tomoskin.sensing.fit.noise import Whitener
from tomoskin.sensing.fit.spot import Response


def fisher_information(response: Response, spots: FloatArray, noise: Whitener) -> FloatArray:
    """(n, 4, 4) information of one frame on each of ``spots`` (n, 4), alone on the sheet.

    For Gaussian noise it is JᵀC⁻¹J (Kay 1993, eq. 3.31 without its second term), in the order of
    the columns: 1/m² for x and y, 1 for the logarithm of the radius, 1/m⁴ for the content.
    """
    whitened = [noise(response.expanded(spot[None])[1].T) for spot in spots]
    jacobians = np.stack(whitened)
    return np.asarray(jacobians @ jacobians.swapaxes(1, 2))


def position_bound(response: Response, spots: FloatArray, noise: Whitener) -> FloatArray:
    """(n, 2, 2) m²: least covariance of an unbiased estimate of each position from one frame.

    Size and strength are unknown too: they are eliminated (Schur complement of the Fisher
    information; Kay 1993, section 3.7). Infinite where a frame tells nothing of the position.
    The reference's own noise belongs into ``noise``: (1 + 1/n) times that of one frame.
    """
    information = fisher_information(response, spots, noise)
    position, nuisance, across = (
        information[:, :2, :2],
        information[:, 2:, 2:],
        information[:, 2:, :2],
    )
    size = np.sqrt(np.maximum(np.einsum("nii->ni", nuisance), 1e-300))
    even = nuisance / size[:, :, None] / size[:, None, :]
    scaled = across / size[:, :, None]
    reduced = position - scaled.swapaxes(1, 2) @ np.linalg.pinv(even, hermitian=True) @ scaled
    bound = np.full(reduced.shape, np.inf)
    finite = np.linalg.eigvalsh(reduced)[:, 0] > 1e-12 * np.trace(position, axis1=1, axis2=2)
    bound[finite] = np.linalg.inv(reduced[finite])
    return bound
