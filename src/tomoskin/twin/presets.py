"""Everything that a twin adds to its skin, and sets of it for known materials."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields, replace
from importlib.resources import files
from typing import Any, Self

import msgspec

from tomoskin.core import ModelError, no_such
from tomoskin.sensing.signal import FIGURES
from tomoskin.twin.bend import BendSettings
from tomoskin.twin.circuit import ElectronicsSettings
from tomoskin.twin.contact import ContactSettings
from tomoskin.twin.faults import LineSettings
from tomoskin.twin.material import MaterialSettings
from tomoskin.twin.parameters import check_numbers


@dataclass(frozen=True)
class TwinSettings:
    """What a twin adds to its skin; the defaults are a sheet and a board without vices.

    Attributes
    ----------
    seed
        Of noise, spread and faults of the line: the same seed gives the same bytes.
    mesh_ratio
        Cells of the twin's mesh per cell of the reconstruction's. The twin's mesh is finer and
        from another seed, so that no image is made with the model that made its data.
    contact, material, electronics, line, bend
        The stages; and where the layer that conducts lies in what is bent.
    """

    seed: int = 0
    mesh_ratio: float = 1.6
    contact: ContactSettings = field(default_factory=ContactSettings)
    material: MaterialSettings = field(default_factory=MaterialSettings)
    electronics: ElectronicsSettings = field(default_factory=ElectronicsSettings)
    line: LineSettings = field(default_factory=LineSettings)
    bend: BendSettings = field(default_factory=BendSettings)

    def __post_init__(self) -> None:
        """Check the refinement of the mesh and the seed."""
        check_numbers(self, above="mesh_ratio", least="seed")

    @staticmethod
    def preset(name: str, seed: int = 0) -> TwinSettings:
        """The settings of that name: one of :data:`PRESETS`.

        Raises
        ------
        ModelError
            For another name.
        """
        if name not in PRESETS:
            raise ModelError(no_such(name, PRESETS, "a preset"), where="twin")
        return replace(PRESETS[name], seed=seed)

    def with_electrodes(self, kind: str | None) -> Self:
        """These settings with electrodes of that kind of a skin file; None: as they are."""
        if kind != "polarising":
            return self
        return replace(self, electronics=replace(self.electronics, **POLARISING))

    def with_noise(self, noise: float) -> Self:
        """These settings with another noise of one conversion, LSB."""
        return replace(self, electronics=replace(self.electronics, noise=noise))


def _preset(table: Mapping[str, Mapping[str, Any]]) -> TwinSettings:
    """Settings from the numbers of each stage; those of electronics that are given at all are on
    :data:`BOARD`."""
    own = {**asdict(BOARD), **table["electronics"]} if "electronics" in table else {}
    return msgspec.convert({**table, "electronics": own}, TwinSettings)


_FILE = tomllib.loads(files("tomoskin.twin").joinpath("presets.toml").read_text(encoding="utf-8"))

BOARD = ElectronicsSettings(
    **{
        field.name: getattr(FIGURES, field.name)
        for field in fields(ElectronicsSettings)
        if hasattr(FIGURES, field.name)
    },
    **_FILE["board"],
)
"""The board of docs/hardware.md."""

POLARISING: dict[str, float] = _FILE["polarising"]
"""Numbers of electrodes on ions."""

SOURCES: dict[str, str] = _FILE["sources"]
"""Where the presets' numbers come from; those not named are assumed."""

PRESETS = {name: _preset(table) for name, table in _FILE["presets"].items()}
"""Settings by name: ``presets.toml``."""
