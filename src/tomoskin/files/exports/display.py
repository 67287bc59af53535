"""How images are shown to people. Nothing here is ever fed to detection, which stands above."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from tomoskin.core import DataError, FloatArray, Image
from tomoskin.imaging import disc_means
from tomoskin.model.mesh import Mesh

_LARGEST = 0.25
"""An average over more than this part of the extent would show nothing."""


@dataclass(frozen=True, slots=True)
class Display:
    """Unit, filter and colour scale of an image.

    Attributes
    ----------
    conductivity
        Of the untouched sheet, S or S/m: changes are shown as a part of it ("relative", drawn
        in per cent). None shows them in S.
    smoothing
        Radius of the circular averaging filter, m; 0 for none.
    limit
        End of the symmetric colour scale, in the unit shown (0.05 is 5 %). None takes the
        greatest value.

    Raises
    ------
    DataError
        For a radius below 0, or a conductivity or limit that is not above 0.
    """

    conductivity: float | None = None
    smoothing: float = 0.0
    limit: float | None = None

    def __post_init__(self) -> None:
        """Refuse numbers that make no picture."""
        for name in ("conductivity", "limit"):
            value = getattr(self, name)
            if value is not None and not (np.isfinite(value) and value > 0):
                raise DataError(f"expected a {name} above 0, got {value}")
        if not (np.isfinite(self.smoothing) and self.smoothing >= 0):
            raise DataError(f"expected a radius of 0 m or more, got {self.smoothing}")

    def shown(self, image: Image, mesh: Mesh) -> Image:
        """``image`` as it is to be seen. Raises DataError when it is of another mesh."""
        if image.mesh_id != mesh.identity:
            raise DataError(
                f"the image belongs to mesh {image.mesh_id}, not to mesh {mesh.identity}"
            )
        values, unit = self.applied(image.values, mesh, image.unit)
        return Image(values, unit, image.mesh_id)

    def applied(self, values: FloatArray, mesh: Mesh, unit: str) -> tuple[FloatArray, str]:
        """Values (…, n_cells) as they are to be seen, and their unit."""
        if self.smoothing:
            values = values @ circular_average(mesh, self.smoothing).T
        if self.conductivity is None or unit == "relative":
            return values, unit
        return values / self.conductivity, "relative"


def circular_average(mesh: Mesh, radius: float) -> csr_array:
    """The thesis's display filter (its section 4.4): mean over a disc, by area.

    Returns
    -------
    (n_cells, n_cells) sparse, rows summing to one: each cell becomes the mean, weighted by
    area, of the cells whose centroids lie within ``radius`` m of its own.

    Raises
    ------
    DataError
        When the radius is not above 0, or larger than a quarter of the sheet's extent.
    """
    most = _LARGEST * float(np.ptp(mesh.points, axis=0).max())
    if not 0 < radius <= most:
        raise DataError(
            f"expected a radius above 0 and up to {1e3 * most:.3g} mm, got {1e3 * radius:.3g} mm",
            where="circular average",
        )
    return disc_means(mesh, radius)
