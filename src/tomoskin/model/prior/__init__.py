"""Priors: what is held to be likely of an image before there are data."""

from tomoskin.model.prior.penalty import (
    Carried,
    Diagonal,
    Penalty,
    dense_penalty,
    sparse_penalty,
)
from tomoskin.model.prior.priors import (
    PRIORS,
    Identity,
    Noser,
    Prior,
    PriorLike,
    SharpPrior,
    Sparse,
    TotalVariation,
    penalty_of,
)
from tomoskin.model.prior.smooth import (
    GaussianHighPass,
    Laplace,
    Matern,
    Structural,
    matern_correlation,
)

__all__ = [
    "PRIORS",
    "Carried",
    "Diagonal",
    "GaussianHighPass",
    "Identity",
    "Laplace",
    "Matern",
    "Noser",
    "Penalty",
    "Prior",
    "PriorLike",
    "SharpPrior",
    "Sparse",
    "Structural",
    "TotalVariation",
    "dense_penalty",
    "matern_correlation",
    "penalty_of",
    "sparse_penalty",
]
