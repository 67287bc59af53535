"""Everything that a twin adds to its skin, and sets of it for known materials."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Self

from tomoskin.core import ModelError
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
        """Check the numbers."""
        check_numbers(self, above="mesh_ratio", least="seed")

    @classmethod
    def preset(cls, name: str, seed: int = 0) -> Self:
        """The settings of that name: one of :data:`PRESETS`.

        Raises
        ------
        ModelError
            For another name.
        """
        if name not in PRESETS:
            raise ModelError(f'expected a twin of {", ".join(PRESETS)}, got "{name}"', where="twin")
        contact, material, electronics, bend = PRESETS[name]
        return cls(
            seed=seed, contact=contact, material=material, electronics=electronics, bend=bend
        )

    def with_electrodes(self, kind: str | None) -> Self:
        """These settings with electrodes of that kind of a skin file; None: as they are."""
        if kind != "polarising":
            return self
        return replace(self, electronics=replace(self.electronics, **POLARISING))

    def with_noise(self, noise: float) -> Self:
        """These settings with another noise of one conversion, LSB."""
        return replace(self, electronics=replace(self.electronics, noise=noise))


BOARD = ElectronicsSettings(
    noise=FIGURES.noise,
    compliance=FIGURES.compliance,
    output_resistance=FIGURES.output_resistance,
    switch_resistance=FIGURES.switch_resistance,
    contact_sd=2e-3,
    contact_time=10.0,
    rejection=90.0,
    gain_sd=0.002,
    offset_sd=50e-6,
    low_rail=FIGURES.low_rail,
    high_rail=FIGURES.high_rail,
    time_constant=FIGURES.time_constant,
    crosstalk=1e-5,
    hum=20e-6,
    hum_frequency=50.0,
    nonlinearity=0.5,
)
"""The board of docs/hardware.md: IRLML6344 and IRLML9301, INA118, an ATmega2560's converter."""

POLARISING = {"double_layer": 100e-6, "leak": 100e3, "thermal_sd": 20e-6, "thermal_time": 60.0}
"""Electrodes on ions. 0.5 cm² of a metal has 10 µF (Bard & Faulkner, Electrochemical Methods, 2001,
ch. 13: 10 to 40 µF/cm² where it is smooth), a rough one some ten times as much. The leak is
assumed: with it an electrode forgets in 10 s. Contacts of copper and solder give 1 to 3 µV/K
(Keithley, Low Level Measurements Handbook, 7th ed., table 3-1): 20 µV for 10 K, over a minute,
which is assumed."""

SOURCES = {
    "noise": "converter assumed; the amplifier's (ngspice deck noise) is a fortieth of it",
    "compliance": "ngspice deck compliance",
    "output_resistance": "ngspice deck compliance: at least; hydrogel, tank: at 1 mA, assumed",
    "switch_resistance": "ngspice deck compliance: mean of high and low side",
    "time_constant": "ngspice deck switching; hydrogel, tank: assumed",
    "rejection": "assumed; INA118 datasheet: at least 110 dB at a gain of 1000, less at lower ones",
    "offset_sd": "INA118 datasheet: at most 50 µV",
    "low_rail": "ngspice deck contacts",
    "high_rail": "ngspice deck contacts",
    "nonlinearity": "assumed, of the size of the ATmega2560's",
    "gauge": "assumed; published for knitted sensors: up to 1.2 (Bozali et al. 2022, Sensors 22, "
    "7688), 2.4 (others)",
    "play": "textile: so that a press of 4 N and 15 mm runs through a loop of 12.5 % of its "
    "response, published for a knit (preprints.org 202308.0816; 3 % for the best: Bozali et al.)",
    "breakdown": "none for a knit; a strip of carbon-filled silicone: 1.4, three quarters of it "
    "with 3 s (docs/force.md)",
    "hum_frequency": "Europe; 60 Hz in America",
    "temperature_coefficient": "silver 0.38 %/K; salt water about −2 %/K (handbooks)",
    "modulus": "foam and gel assumed; tank: ρg · thickness (Archimedes)",
    "tension": "sheet assumed; gel: its shear modulus · thickness / 3 (Pasternak)",
    "lock": "textile: chosen so that wider probes change more, as in the thesis's figure 5.7",
    "height": "textile: thickness of the foam, glued to what bends; gel: half of it, as all of it "
    "conducts; a tank does not bend",
    "compression": "gel and tank: −1, the layer that conducts gets thinner",
}
"""Where the presets' numbers come from; those not named are assumed."""

PRESETS: dict[str, tuple[ContactSettings, MaterialSettings, ElectronicsSettings, BendSettings]] = {
    "ideal": (ContactSettings(), MaterialSettings(), ElectronicsSettings(), BendSettings()),
    "textile": (
        ContactSettings(),
        MaterialSettings(
            gauge_across=5.0,
            compression=0.05,
            creep=(0.04, 0.03),
            creep_times=(1.0, 30.0),
            play=(0.25,),
            play_widths=(5.5e-3,),
            temperature_coefficient=0.0038,
            temperature_sd=0.2,
            spread=0.03,
            wear=2e-4,
        ),
        BOARD,
        BendSettings(),
    ),
    "hydrogel": (
        ContactSettings(
            modulus=20e3,
            thickness=5e-3,
            lock=0.8,
            poisson=0.49,
            tension=11.0,
            stiffness=100.0,
            sheet_poisson=0.49,
            bulge=0.3,
            friction=0.1,
        ),
        MaterialSettings(
            gauge=1.0,
            compression=-1.0,
            thickness=5e-3,
            creep=(0.1,),
            creep_times=(3.0,),
            temperature_coefficient=-0.02,
            temperature_sd=0.2,
            spread=0.02,
        ),
        replace(BOARD, output_resistance=2.5e6, contact_sd=1.0, time_constant=100e-6),
        BendSettings(height=2.5e-3),
    ),
    "tank": (
        ContactSettings(
            modulus=981.0,
            thickness=0.1,
            lock=1.0,
            poisson=0.49,
            tension=0.0,
            stiffness=0.0,
            bulge=0.0,
            friction=0.0,
            rolling_friction=0.0,
        ),
        MaterialSettings(
            gauge=0.0,
            compression=-1.0,
            thickness=0.1,
            temperature_coefficient=-0.02,
            temperature_sd=0.1,
        ),
        replace(BOARD, output_resistance=2.5e6, contact_sd=0.5, time_constant=100e-6),
        BendSettings(height=0.0),
    ),
}
"""Contact, material, electronics and bending by name.

ideal: no vices, no memory. textile: silver-plated knit over soft foam. hydrogel: a slab of ionic
gel on a rigid ground. tank: saline 100 mm deep; a probe is an insulating body that floats, so
that its force is its weight (a Winkler foundation of ρg)."""
