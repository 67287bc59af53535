"""Unlabelled touches laid out flat, so that neighbours in their data are neighbours there."""

from __future__ import annotations

import numpy as np
from scipy.linalg import eigh
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import shortest_path

from tomoskin.core import FloatArray
from tomoskin.learning.touch.process import squared_distances
from tomoskin.learning.touch.ranks import affine_terms

_ROUGH = 5.0
"""Labels for which all rough positions together count."""


def unfolded(scores: FloatArray, neighbours: int) -> FloatArray:
    """(n, 2) coordinates whose distances are those along the frames' manifold.

    Isomap (Tenenbaum, de Silva & Langford 2000): from frame to frame by way of ``neighbours``.
    """
    away = np.sqrt(squared_distances(scores, scores))
    n = len(away)
    near = np.argsort(away, axis=1)[:, 1 : neighbours + 1]
    links = np.take_along_axis(away, near, axis=1).ravel()
    ends = (np.repeat(np.arange(n), neighbours), near.ravel())
    along = shortest_path(csr_matrix((links, ends), (n, n)), directed=False)
    along = np.where(np.isfinite(along), along, along[np.isfinite(along)].max()) ** 2
    about = along - along.mean(axis=0) - along.mean(axis=1, keepdims=True) + along.mean()
    size, axes = eigh(-0.5 * about, subset_by_index=(n - 2, n - 1))
    return np.asarray(axes * np.sqrt(np.maximum(size, 0.0)))


def laid_over(layout: FloatArray, rough: FloatArray, labels: FloatArray) -> FloatArray:
    """(n, 2) the ``layout`` (n, 2) moved by an affine map to where the frames were.

    ``rough`` (n, 2) positions, of which each says little; ``labels`` (n, 2), NaN where none is.
    """
    known = np.isfinite(labels).all(axis=1, keepdims=True)
    root = np.sqrt(np.where(known, 1.0, _ROUGH / len(layout)))
    terms = affine_terms(layout)
    target = np.where(known, labels, rough)
    return np.asarray(terms @ np.linalg.lstsq(terms * root, target * root, rcond=None)[0])
