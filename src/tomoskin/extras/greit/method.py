"""``method = "greit"`` of a skin file: a trained operator in place of one step."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from tomoskin.model.section import Number, key

if TYPE_CHECKING:
    from tomoskin.core import FloatArray
    from tomoskin.imaging import AlphaChoice, Operator
    from tomoskin.model.forward import ForwardModel

_ERROR = 0.003
"""What a model gets wrong in a measurement, as a part of the data of a training target."""

_RADIUS = 0.125
"""Radius with which targets are shown: objects nearer than two of them have one maximum. With so
little noise it may be less than usual. Chosen of 0.15, 0.125, 0.1 and 0.075 on the rigs that the
error was chosen by, and the even cases of KIT4: it alone loses none and shows no ghost."""


@dataclass(frozen=True)
class Trained:
    """The operator, and what its noise is weighed by. It is loaded when it is asked for."""

    meaning: ClassVar[str] = (
        "an operator trained to show small targets as a stated response; truer positions, not "
        "sharper."
    )

    noise_figure: float = key(
        Number(0.1, 100),
        "Ratio of the signal-to-noise ratio of the voltages to that of the image.",
        default=1.0,
        method="greit",
    )

    def operator(
        self, model: ForwardModel, conductivity: float, difference: str
    ) -> tuple[AlphaChoice, Operator]:
        """Trained with the model itself. Raises ModelError where no weight has that figure."""
        from tomoskin.extras.greit.trainer import Greit
        from tomoskin.imaging import AlphaChoice

        figure = self.noise_figure
        made = Greit(model, conductivity=conductivity, difference=difference, noise_figure=figure)
        reason = f"trained operator, its noise weighed for a noise figure of {figure:g}"
        return AlphaChoice(made.noise_weight, "greit", reason), made

    def for_recording(
        self, operator: Operator, weights: FloatArray
    ) -> tuple[AlphaChoice, Operator] | None:
        """The same, where its noise figure is the usual one; it says what it rests on."""
        from tomoskin.extras.greit.trainer import Greit
        from tomoskin.imaging import AlphaChoice

        if not isinstance(operator, Greit) or self.noise_figure != Trained.noise_figure:
            return None
        weight = _ERROR**2 * len(weights)
        trained = operator.weighed(weights**-0.5, weight, _RADIUS)
        reason = f"measurements are trusted to {100 * _ERROR:g} % of a target's data"
        return AlphaChoice(weight, "model-error", reason), trained


GREIT = Trained()
