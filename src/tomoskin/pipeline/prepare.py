"""The model flow: from a skin to everything that a frame needs, made once."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tomoskin.calibration import (
    BendCalibration,
    BendModel,
    Calibration,
    Locator,
    StatesCalibration,
    Teller,
)
from tomoskin.core import DataError, FloatArray, Image, IntArray, ModelError
from tomoskin.forward import ForwardModel
from tomoskin.inverse import (
    AlphaChoice,
    Greit,
    LightTouch,
    LinearProblem,
    Modes,
    Operator,
    Prior,
    Spectrum,
    named_prior,
)
from tomoskin.mesh import Mesh
from tomoskin.pattern import Pattern, Scan
from tomoskin.signal import NuisanceSubspace, Readout, Reference, difference_noise
from tomoskin.skin import Skin
from tomoskin.touch import ImageNoise, Region, Segmenter, SpotModel

BODY = ("outline", "surface", "electrodes", "material", "drive", "readout", "mesh", "twin")
"""Sections of a skin that sheet, mesh and scan rest on; the others only make pictures of it."""

_SAME_SHAPE = 1e-4
"""Outlines within so many metres of each other are one."""


@dataclass(frozen=True, eq=False)
class Prepared:
    """What was made once for a skin.

    Attributes
    ----------
    skin, mesh, pattern, scan, model, problem, operator, segmenter, readout
        The stages, in the order of the flow.
    modes
        The operator's, for a filter over frames; None where the skin has no time constant.
    choice
        The operator's alpha, and what chose it.
    light_touch
        Chooses alpha again when the noise has been measured; None where it was set by hand.
    spots
        What touches are fitted with; None where they are found in the image, and no bends are read
        beside them.
    locator
        Where labelled presses tell the places of touches.
    bending
        What bends of the skin do to the data; None where that was not learnt.
    teller
        Tells which of the states that were learnt a frame shows; None where none were.
    """

    skin: Skin
    mesh: Mesh
    pattern: Pattern
    scan: Scan
    model: ForwardModel
    problem: LinearProblem
    operator: Operator
    modes: Modes | None
    segmenter: Segmenter
    readout: Readout
    choice: AlphaChoice
    light_touch: LightTouch | None
    spots: SpotModel | None
    locator: Locator | None = None
    bending: BendModel | None = None
    teller: Teller | None = None

    def __post_init__(self) -> None:
        """Refuse stages of different meshes or patterns."""
        self.operator.accept(self.pattern)
        made_for = self.operator.model.mesh.identity
        for stage, mesh in (("skin", self.mesh), ("segmenter", self.segmenter.mesh)):
            if mesh.identity != made_for:
                raise ModelError(
                    f"the operator is of mesh {made_for}, the {stage} of mesh {mesh.identity}"
                )

    def with_alpha(self, choice: AlphaChoice, spectrum: Spectrum, operator: Operator) -> Prepared:
        """The skin with the ``operator`` of ``choice``, made from the ``spectrum``."""
        modes = None
        if self.skin.inverse.time_constant:
            modes = Modes.of_spectrum(spectrum, choice.alpha, operator)
        return replace(self, operator=operator, modes=modes, choice=choice)

    def that_bends(self, bending: BendModel) -> Prepared:
        """With what was learnt of the skin's bends. Raises DataError for those of other rows."""
        if len(bending.directions) != self.pattern.n_meas:
            raise DataError(
                f"expected bends of {self.pattern.n_meas} rows, got {len(bending.directions)}"
            )
        spots = self.spots or SpotModel.of(self.skin, self.model)
        return replace(self, bending=bending, spots=spots)

    def that_tells(self, states: StatesCalibration) -> Prepared:
        """With states that were learnt, on this skin with any settings of its pictures.

        Raises DataError for those of another pattern.
        """
        states.classifier.check(self.pattern.identity)
        return replace(self, teller=Teller.of(states.classifier))

    def located_by(self, locator: Locator | None) -> Prepared:
        """With places of touches from a calibration, or without.

        It rests on rows and places alone, so that other settings of the picture do not matter.
        Raises DataError where it is of another pattern or a sheet of another shape.
        """
        if locator is not None:
            locator.check(self.pattern)
            outline = Region.of(self.skin).outline
            known = locator.region.outline
            if locator.skin_id and not (
                outline.shape == known.shape and np.allclose(outline, known, atol=_SAME_SHAPE)
            ):
                raise DataError("the calibration is of a sheet of another shape")
        return replace(self, locator=locator)

    @property
    def calibration(self) -> Calibration | None:
        """The locator as it is written to a file."""
        if self.locator is None:
            return None
        return Calibration(self.locator, self.pattern, self.skin.name)

    @property
    def states(self) -> StatesCalibration | None:
        """The states as they are written to a file."""
        if self.teller is None:
            return None
        return StatesCalibration(self.teller.classifier, self.pattern, self.skin.name)

    @property
    def bends(self) -> BendCalibration | None:
        """The bends as they are written to a file."""
        if self.bending is None:
            return None
        return BendCalibration(self.bending, self.pattern, self.skin.name)

    def without(self, rows: IntArray) -> Prepared:
        """The skin as if its pattern had never had ``rows``; an alpha of "auto" is chosen anew.

        Raises DataError when no row is left, or its bends do not show in those that are.
        """
        if not len(rows):
            return self
        left = _prepared(self.skin, self.problem.without(rows))
        left = replace(left, teller=self.teller and self.teller.without(rows))
        return left if self.bending is None else left.that_bends(self.bending.without(rows))

    def blind_to(self, directions: FloatArray) -> Prepared:
        """The skin whose prior knows that data along ``directions`` (n_meas, k) say nothing.

        A prior that weighs by sensitivity then holds changes beside a lost electrode for as
        likely as elsewhere. Trained operators, and those with a filter over frames, stay.
        """
        if self.skin.inverse.method != "one-step" or self.modes is not None:
            return self
        basis = np.linalg.qr(directions)[0]
        jacobian = self.problem.jacobian
        left = jacobian - basis @ (basis.T @ jacobian)
        prior = _prior(self.skin).penalty(self.mesh, left)
        operator = replace(self.problem, prior=prior).operator(self.choice.alpha)
        return replace(self, operator=operator)

    def noise_floor(
        self, reference: Reference, blind: NuisanceSubspace | None = None
    ) -> ImageNoise | None:
        """What the noise of a reference does to the picture; None where it is not known.

        ``blind``: what the data do not tell.
        """
        if not reference.noise_is_known:
            return None
        matrix = self.operator.matrix if blind is None else blind.seen_by(self.operator.matrix)
        spread = matrix * self.difference_noise(reference)
        return ImageNoise.of(spread, self.mesh.identity)

    def difference_noise(self, reference: Reference) -> FloatArray:
        """(n_meas,) standard deviation of difference data against that reference."""
        return difference_noise(reference.noise, reference.mean, self.operator.difference)

    def predicted_noise(self) -> FloatArray:
        """(n_meas,) standard deviation of difference data that the read-out predicts."""
        return _predicted(self.problem, self.readout)

    def places(self, image: FloatArray) -> FloatArray:
        """(k, 2) m, where the touches of an image (n_cells,) are."""
        picture = Image(image, self.operator.unit, self.mesh.identity)
        found = [(reading.x, reading.y) for reading in self.segmenter(picture)]
        return np.array(found).reshape(-1, 2)


def prepare(skin: Skin) -> Prepared:
    """Mesh, model, operator and stages of ``skin``.

    Where the skin's alpha is "auto", it is chosen by the noise that its read-out predicts.

    Raises
    ------
    TomoskinError
        When the skin cannot be meshed, modelled or inverted; the message says which.
    """
    model = ForwardModel(
        skin.mesh(), skin.pattern(), skin.contact_impedance, skin.polarity * skin.current
    )
    problem = LinearProblem.of(
        model,
        _prior(skin),
        conductivity=skin.conductivity,
        difference=skin.inverse.difference,
    )
    return _prepared(skin, problem)


def prepare_again(before: Prepared, skin: Skin) -> Prepared:
    """:func:`prepare` for a skin with other settings: what they leave as it is serves again.

    Raises as :func:`prepare` does.
    """
    if not same_body(before.skin, skin):
        return prepare(skin)
    problem, settings, then = before.problem, skin.inverse, before.skin.inverse
    if settings.difference != then.difference:
        problem = LinearProblem.of(
            before.model,
            _prior(skin),
            conductivity=skin.conductivity,
            difference=settings.difference,
        )
    elif _prior(skin) != _prior(before.skin):
        penalty = _prior(skin).penalty(before.mesh, problem.jacobian)
        problem = replace(problem, prior=penalty)
    return _prepared(skin, problem, before)


def same_body(one: Skin, other: Skin) -> bool:
    """Whether both have the same sheet, mesh and scan: only pictures and touches may differ."""
    return all(one.document[name] == other.document[name] for name in BODY)


def _prior(skin: Skin) -> Prior:
    settings = skin.inverse
    return named_prior(
        settings.prior,
        exponent=settings.exponent,
        correlation_length=settings.correlation_length,
    )


def _prepared(skin: Skin, problem: LinearProblem, before: Prepared | None = None) -> Prepared:
    """``before``: the same skin with other settings, of which what is the same serves again."""
    model = problem.model
    scan = Scan.of(model.pattern)
    readout = Readout.of(scan, skin.readout)
    same = before is not None and before.problem is problem
    light_touch, choice, operator = _chosen(
        problem, skin, readout, before.light_touch if before and same else None
    )
    segmenter = before.segmenter if before and before.skin.touch == skin.touch else None
    bending = before.bending if before else None
    spots = None
    if skin.touch.method == "fit" or bending is not None:
        kept = before.spots if before and _same_difference(before.skin, skin) else None
        spots = kept or SpotModel.of(skin, model)
    return Prepared(
        skin=skin,
        mesh=model.mesh,
        pattern=model.pattern,
        scan=scan,
        model=model,
        problem=problem,
        operator=operator,
        modes=Modes.of(problem, operator) if skin.inverse.time_constant else None,
        segmenter=segmenter or Segmenter(model.mesh, skin.touch),
        readout=readout,
        choice=choice,
        light_touch=light_touch,
        spots=spots,
        locator=before.locator if before else None,
        bending=bending,
        teller=before.teller if before else None,
    )


def _same_difference(one: Skin, other: Skin) -> bool:
    return one.inverse.difference == other.inverse.difference


def _chosen(
    problem: LinearProblem, skin: Skin, readout: Readout, light_touch: LightTouch | None
) -> tuple[LightTouch | None, AlphaChoice, Operator]:
    if skin.inverse.method == "greit":
        return None, *_trained(problem.model, skin)
    alpha = skin.inverse.alpha
    if not isinstance(alpha, str):
        by_hand = AlphaChoice(alpha, "hand", "set by hand")
        return None, by_hand, problem.operator(alpha)
    light_touch = light_touch or LightTouch.of(Spectrum.of(problem))
    choice = light_touch(_predicted(problem, readout))
    choice = replace(choice, reason=f"{choice.reason}, as its read-out predicts it")
    return light_touch, choice, light_touch.spectrum.operator(choice.alpha)


def _trained(model: ForwardModel, skin: Skin) -> tuple[AlphaChoice, Operator]:
    figure = skin.inverse.noise_figure
    operator = Greit(
        model,
        conductivity=skin.conductivity,
        difference=skin.inverse.difference,
        noise_figure=figure,
    )
    reason = f"trained operator, its noise weighed for a noise figure of {figure:g}"
    return AlphaChoice(operator.noise_weight, "greit", reason), operator


def _predicted(problem: LinearProblem, readout: Readout) -> FloatArray:
    rows = np.full(len(problem.reference), readout.noise)
    return difference_noise(rows, problem.reference, problem.difference)
