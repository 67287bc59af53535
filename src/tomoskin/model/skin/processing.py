"""The skin file: what the host makes of the voltages; a page may change most of it live."""

from __future__ import annotations

from typing import Any

from tomoskin.core import registered
from tomoskin.model.prior import PRIORS
from tomoskin.model.section import Choice, Number, NumberOrWord, Quantity, Section, Whole, key

_ONE_STEP = "one-step"
_IN_IMAGE = ("method", ("image",))

METHODS: dict[str, Any] = {name: one.load() for name, one in registered("methods").items()}
"""What else than one step makes an image, by the word for it; see ``tomoskin.imaging.Method``."""


class MeshSettings(Section, section="mesh"):
    """The triangles that the image is made of."""

    cells: int = key(
        Whole(50, 100_000),
        "Wanted number of triangles; the mesh has this number within 10 %.",
        default=1500,
    )


class InverseSettings(Section, section="inverse"):
    """How voltages become an image."""

    method: str = key(
        Choice((_ONE_STEP, *METHODS)),
        "one-step: the most likely image under a prior."
        + "".join(f" {name}: {one.meaning}" for name, one in METHODS.items()),
        default=_ONE_STEP,
        options=METHODS,
    )
    prior: str = key(
        Choice(tuple(PRIORS)),
        "Prior: the changes of conductivity that are assumed to be likely. Images of laplace and "
        "gaussian are smooth up to the rim, so that touches of method image lie too far out.",
        default="noser",
        options=PRIORS,
        method=_ONE_STEP,
    )
    alpha: float | str = key(
        NumberOrWord(Number(1e-9, 1e9), Choice(("auto",))),
        "Weight of the prior; it enters squared. auto: chosen by the noise, for a light touch.",
        default="auto",
        method=_ONE_STEP,
    )
    difference: str = key(
        Choice(("plain", "normalised")), "v − v_ref, or (v − v_ref)/|v_ref|.", default="plain"
    )
    time_constant: float = key(
        Quantity("time", "s", 0, 3600),
        "Time constant of the filter over frames (Kalman filter): a longer one has less noise "
        "and more delay. 0 s: each image uses its own frame alone.",
        default="0 s",
        method=_ONE_STEP,
    )


class SignalSettings(Section, section="signal"):
    """What becomes of the reference while time goes by."""

    baseline: str = key(
        Choice(("follow", "hold")),
        "follow: the reference follows the skin's drift while nothing touches, and stays fixed "
        "under a touch. hold: it stays the same until the next one is taken.",
        default="follow",
    )
    common_modes: str = key(
        Choice(("projected", "kept")),
        "projected: proportional changes of all voltages, as from temperature, and directions of "
        "drift learnt while idle do not show in the image. kept: they show.",
        default="projected",
    )


class TouchSettings(Section, section="touch"):
    """How difference data become touches."""

    method: str = key(
        Choice(("fit", "image")),
        "fit: position, size and strength of up to five touches, fitted to the voltages, with "
        "standard deviations. image: the thesis's regions of the image, set by gamma1 to "
        "position.",
        default="fit",
    )
    gamma1: float = key(
        Number(0.1, 0.99),
        "First threshold, as a fraction of the extreme value; 0.6 to 0.7 is usual.",
        default=0.65,
        effective=_IN_IMAGE,
    )
    gamma2: float = key(
        Number(0.1, 1),
        "Second threshold, after smoothing, as a fraction of the first.",
        default=0.9,
        effective=_IN_IMAGE,
    )
    smoothing: float = key(
        Quantity("length", "mm", 0, 1000),
        "Standard deviation of the Gaussian between the two thresholds.",
        default="5 mm",
        effective=_IN_IMAGE,
    )
    sign: str = key(
        Choice(("decrease", "increase", "both")),
        "Change of conductivity that counts as a touch.",
        default="decrease",
    )
    snr: float = key(
        Number(0, 1000),
        "Extreme value that a touch needs, in standard deviations of the noise.",
        default=5,
    )
    position: str = key(
        Choice(("centroid", "peak")),
        "One touch a region, at its weighted centroid; or one at each local extreme.",
        default="centroid",
        effective=_IN_IMAGE,
    )
    max_touches: int = key(Whole(1, 50), "Largest number of touches reported at once.", default=8)
    slide_lag: float | None = key(
        Quantity("length", "mm", 0, 100),
        "Distance by which the sheet's response lags behind a sliding finger, because friction "
        "drags the sheet along. Sliding touches are reported ahead by this distance. Default: "
        "that of a calibration from rubbing, else none.",
        default=None,
    )


_SMOOTH = ("laplace", "gaussian")
"""Priors under which nothing keeps an image from being largest at the rim. On the textile twins of
200 mm, regions of it were 15 mm too far out with 8 electrodes, whatever the alpha, and 5 with 16;
under noser 5 and 4 mm off, on all sides."""


def regions_doubt(inverse: InverseSettings, touch: TouchSettings) -> str | None:
    """What is said of touches that are regions of a smooth image; None of others."""
    if touch.method != "image" or inverse.method != _ONE_STEP or inverse.prior not in _SMOOTH:
        return None
    return (
        f'images under prior "{inverse.prior}" are smooth up to the rim, so that touches of method '
        '"image" lie too far out (by 15 mm on a disc with 8 electrodes): prior "noser" is nearer'
    )


class TwinChoice(Section, section="twin"):
    """The simulated skin that stands in for this one; a real skin does not read it."""

    preset: str = key(
        Choice(("ideal", "textile", "hydrogel", "tank")),
        "Material and board: ideal has no errors and no memory; the others have measured or "
        "assumed ones.",
        default="ideal",
    )
    electrodes: str | None = key(
        Choice(("ideal", "polarising")),
        "polarising: they charge under current, as on a gel, and their contacts warm and cool; "
        "an alternating drive does not see it.",
        default=None,
    )
