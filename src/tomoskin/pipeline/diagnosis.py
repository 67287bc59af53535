"""What is likely the matter with a frame: one cause at a time, the likeliest first."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from enum import IntEnum, auto

from tomoskin.sensing.fit import Deformation
from tomoskin.sensing.signal import Health

_BROKEN = frozenset({"open", "short", "railed", "stuck"})
"""States of an electrode that no deformation of the sheet looks like."""


class Cause(IntEnum):
    """Causes, in the order in which they are told where several may explain one frame.

    What only one thing can cause comes before what many can: an electrode that is open shows as
    that alone, a fold has an axis that no supply has, and a change of all voltages alike says
    least.
    """

    NO_IMAGE = auto()
    """Too few measurements are left."""
    ELECTRODE = auto()
    """One is broken, or its wire."""
    TAUGHT = auto()
    """What a calibration reads does not fit it any more."""
    DEFORMATION = auto()
    """A fold, a stretch, or what neither explains."""
    CONTACT = auto()
    """An electrode is loose, or noisy."""
    MEASUREMENTS = auto()
    """Some cannot be used."""
    SUPPLY = auto()
    """All voltages differ by one factor for long, or by much: supply or gain, else warmth."""
    REFERENCE = auto()
    """It was taken under a press."""
    STEP = auto()
    """All voltages have changed by one factor at once, by little."""
    NOISE = auto()
    """More than the idle skin has."""
    STALE = auto()
    """A touch has held the reference for long."""


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """A ``cause``, and a sentence for people that says what is seen, and what to do next."""

    cause: Cause
    text: str

    @property
    def key(self) -> str:
        """The same in frames that show the same: the numbers of a deformation change with each."""
        return self.cause.name if self.cause is Cause.DEFORMATION else self.text


def likeliest(diagnoses: Iterable[Diagnosis | None]) -> Diagnosis | None:
    """The one to be told."""
    return min((one for one in diagnoses if one is not None), key=_rank, default=None)


def _rank(diagnosis: Diagnosis) -> Cause:
    return diagnosis.cause


def of_deformation(deformation: Deformation | None) -> Diagnosis | None:
    """What a deformation has to say, where there is one."""
    if deformation is None:
        return None
    if deformation.kind != "common":
        plain = replace(deformation, confused=None).text  # a page shows the first words
        also = f"; it may as well be {deformation.confused}" if deformation.confused else ""
        return Diagnosis(Cause.DEFORMATION, f"{plain}; {_NEXT[deformation.kind]}{also}")
    amount = deformation.amount
    level = "" if amount is None else f" by {100 * amount.value:+.2g} %"
    return Diagnosis(
        Cause.SUPPLY,
        f"the whole sheet conducts otherwise{level}: likely gain or supply, else warmth or an even "
        "stretch; check current, supply and cables, or take a new reference",
    )


_NEXT = {
    "fold": "lay it flat, or take a new reference if it is to stay so",
    "stretch": "let it go, or take a new reference if it is to stay so",
    "unknown": "or take a new reference",
}
"""What to do about each kind."""


def of_measurements(
    health: Health | None, left_out: int, n_meas: int, *, has_image: bool
) -> Diagnosis | None:
    """What electrodes, and the measurements that are ``left_out`` of ``n_meas``, have to say."""
    if health is not None and health.sick:
        if not has_image:
            return Diagnosis(
                Cause.NO_IMAGE,
                f"{health.text}; too few rows are left for an image: check the electrodes",
            )
        broken = any(electrode.state in _BROKEN for electrode in health.sick)
        text = f"{health.text}; the image is made without {left_out} rows"
        return Diagnosis(Cause.ELECTRODE if broken else Cause.CONTACT, text)
    if not left_out:
        return None
    rows = f"{left_out} of {n_meas} rows"
    if not has_image:
        return Diagnosis(
            Cause.NO_IMAGE,
            f"{rows} are at a rail of the converter or without a reference, so no image is "
            "shown: check the electrodes and the gain",
        )
    return Diagnosis(
        Cause.MEASUREMENTS,
        f"{rows} are at a rail of the converter or without a reference: the image is made "
        "without them",
    )
