"""Priors: what is held to be likely of an image before there are data."""

from tomoskin.model.prior.penalty import (
    Carried as Carried,
    Diagonal as Diagonal,
    Penalty as Penalty,
)
from tomoskin.model.prior.priors import (
    PRIORS as PRIORS,
    Noser as Noser,
    PriorLike as PriorLike,
    SharpPrior as SharpPrior,
    Sparse as Sparse,
    TotalVariation as TotalVariation,
    penalty_of as penalty_of,
)
from tomoskin.model.prior.smooth import (
    Laplace as Laplace,
    Matern as Matern,
    Structural as Structural,
    matern_correlation as matern_correlation,
    pivoted_cholesky as pivoted_cholesky,
)
