"""The model flow: from a skin to everything that a frame needs, made once."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from tomoskin.board.source import Configuration, ScanSettings
from tomoskin.core import DataError, FloatArray, Image, IntArray, ModelError, StrPath, reach
from tomoskin.imaging import (
    AlphaChoice,
    LightTouch,
    LinearProblem,
    Method,
    Modes,
    Operator,
    Spectrum,
)
from tomoskin.learning import Calibration, Kind, load_calibration
from tomoskin.model.forward import ForwardModel
from tomoskin.model.mesh import Mesh
from tomoskin.model.pattern import Pattern, Scan
from tomoskin.model.skin import METHODS, Ambiguity, Skin
from tomoskin.sensing.fit import SpotModel
from tomoskin.sensing.segment import ImageNoise, Segmenter
from tomoskin.sensing.signal import Headroom, NuisanceSubspace, Readout, Reference, difference_noise

_RADIUS = 0.015
"""m, of the touch that the scale of colours is made for."""


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
        What touches are fitted with; None where nothing is fitted.
    calibrations
        What was learnt from examples, by the name of its kind.
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
    calibrations: Mapping[str, Calibration[Any]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Refuse stages of different meshes or patterns."""
        self.operator.accept(self.pattern)
        made_for = self.operator.model.mesh.identity
        for stage, mesh in (("skin", self.mesh), ("segmenter", self.segmenter.mesh)):
            if mesh.identity != made_for:
                raise ModelError(
                    f"the operator belongs to mesh {made_for}, the {stage} to mesh {mesh.identity}"
                )

    def with_alpha(self, choice: AlphaChoice, spectrum: Spectrum, operator: Operator) -> Prepared:
        """The skin with the ``operator`` of ``choice``, made from the ``spectrum``."""
        modes = None
        if self.skin.inverse.time_constant:
            modes = Modes.of(spectrum, choice.alpha, operator)
        return replace(self, operator=operator, modes=modes, choice=choice)

    def calibrated(self, calibration: Calibration[Any]) -> Prepared:
        """With a calibration, in place of an earlier one of its kind.

        Raises DataError where it is not of this skin.
        """
        calibration.check(self.skin)
        return self._with({**self.calibrations, calibration.kind.name: calibration})

    def uncalibrated(self, kind: Kind[Any] | None = None) -> Prepared:
        """Without a calibration of that kind; None: without any."""
        kept = {k: c for k, c in self.calibrations.items() if kind is not None and k != kind.name}
        return self._with(kept)

    def _with(self, calibrations: Mapping[str, Calibration[Any]]) -> Prepared:
        spots = None
        if _fits(self.skin, calibrations):
            spots = self.spots or SpotModel.of(self.skin, self.model)
        return replace(self, calibrations=calibrations, spots=spots)

    def warm_up(self) -> None:
        """Do what would hold up the first frames: it takes seconds the first time for a skin."""
        if self.spots is not None:
            reach("touches")
            self.spots.warm_up()

    @cached_property
    def no_image(self) -> Image:
        """The image of data that have not changed."""
        return self.operator(np.zeros(self.pattern.n_meas))

    @cached_property
    def headroom(self) -> Headroom:
        """What the untouched skin asks of the board, and what that gives."""
        return Headroom.of(self.skin, self.model.at(self.skin.conductivity))

    @cached_property
    def ambiguity(self) -> Ambiguity | None:
        """Which places the skin's pattern cannot tell apart; None where it tells all."""
        return self.skin.ambiguity(lambda: self.problem.jacobian)

    @property
    def directions(self) -> FloatArray:
        """(n_meas, k) V along which what its calibrations read moves the data."""
        own = [c.kind.directions(c.model) for c in self.calibrations.values() if c.kind.directions]
        return np.hstack([np.zeros((self.pattern.n_meas, 0)), *own])

    def without(self, measurements: IntArray) -> Prepared:
        """The skin as if its pattern had never had them; an alpha of "auto" is chosen anew.

        Raises DataError when none is left, or a calibration does not show in those that are.
        """
        if not len(measurements):
            return self
        reduced = _prepared(self.skin, self.problem.without(measurements))
        kept = (c.without(measurements) for c in self.calibrations.values())
        return reduced._with({c.kind.name: c for c in kept if c is not None})

    def without_directions(self, directions: FloatArray) -> Prepared:
        """The skin whose prior knows that data along ``directions`` (n_meas, k) say nothing.

        A prior that weighs by sensitivity then holds changes beside a lost electrode for as
        likely as elsewhere. Trained operators, and those with a filter over frames, stay, and so
        does any where nothing else is left.
        """
        if self.skin.inverse.method != "one-step" or self.modes is not None:
            return self
        basis = np.linalg.qr(directions)[0]
        jacobian = self.problem.jacobian
        projected = jacobian - basis @ (basis.T @ jacobian)
        if not projected.any(axis=0).all():  # nothing is left to weigh by
            return self
        prior = self.skin.inverse.record("prior").penalty(self.mesh, projected)
        operator = replace(self.problem, prior=prior).operator(self.choice.alpha)
        return replace(self, operator=operator)

    def image_noise(
        self, reference: Reference, subspace: NuisanceSubspace | None = None
    ) -> ImageNoise | None:
        """What the noise of a reference does to the picture; None where it is not known.

        ``subspace``: what the data do not tell.
        """
        if not reference.noise_is_known:
            return None
        matrix = self.operator.matrix
        if subspace is not None:
            matrix = subspace.projected(matrix)
        spread = matrix * self.difference_noise(reference)
        return ImageNoise.of(spread, self.mesh.identity)

    @cached_property
    def longest_scan(self) -> float:
        """Duration of a scan on the slowest board, s."""
        return Configuration.of(self.scan, ScanSettings.of(self.skin)).scan_time

    def difference_noise(self, reference: Reference) -> FloatArray:
        """(n_meas,) standard deviation of difference data against that reference."""
        return difference_noise(reference.noise, reference.mean, self.operator.difference)

    def predicted_noise(self) -> FloatArray:
        """(n_meas,) standard deviation of difference data that the read-out predicts."""
        return _predicted(self.problem, self.readout)


def prepare(skin: Skin, previous: Prepared | None = None) -> Prepared:
    """Mesh, model, operator and stages of ``skin``.

    Where the skin's alpha is "auto", it is chosen by the noise that its read-out predicts. Of
    ``previous``, the same body with other settings, all that these leave as it is serves again,
    and its calibrations stay. :func:`~tomoskin.core.watch_stages` is called with its stages.

    Raises
    ------
    TomoskinError
        When the skin cannot be meshed, modelled or inverted, or a calibration cannot serve it any
        more; the message says which.
    """
    with threadpool_limits(1):  # faster, and sums keep their order on a machine of more cores
        if previous is not None and previous.skin.body == skin.body:
            for calibration in previous.calibrations.values():
                calibration.check(skin)
            return _prepared(skin, _problem_after(previous, skin), previous)
        return _prepared(skin, _problem(_model(skin), skin))


def ambiguity_of(skin: Skin) -> Ambiguity | None:
    """Which places the pattern of ``skin`` cannot tell apart, by its model; None where it tells
    all. Raises TomoskinError where it cannot be meshed or modelled."""
    return skin.ambiguity(lambda: _model(skin).jacobian(skin.conductivity))


def with_calibrations(
    prepared: Prepared, paths: Iterable[StrPath], skin: Skin | None = None
) -> Prepared:
    """The skin with calibrations of any kind from files.

    ``skin``: the one that they must be of, as its file says, where images are made otherwise.
    Raises DataError for calibrations of another skin, and for two of one kind.
    """
    named: dict[str, StrPath] = {}
    for path in paths:
        calibration = load_calibration(path)
        kind = calibration.kind
        if kind.name in named:
            raise DataError(
                f"is a calibration of {kind.subject}, and so is {named[kind.name]}",
                where=str(path),
                hint="give only one of them",
            )
        named[kind.name] = path
        if kind.own_settings:
            calibration.check_skin(skin or prepared.skin)
        prepared = prepared.calibrated(calibration)
    return prepared


def _model(skin: Skin) -> ForwardModel:
    reach("mesh")
    mesh = skin.mesh()
    reach("model")
    return ForwardModel(mesh, skin.pattern(), skin.contact_impedance, skin.polarity * skin.current)


def _problem(model: ForwardModel, skin: Skin) -> LinearProblem:
    return LinearProblem.of(
        model,
        skin.inverse.record("prior"),
        conductivity=skin.conductivity,
        difference=skin.inverse.difference,
    )


def _problem_after(previous: Prepared, skin: Skin) -> LinearProblem:
    """The linear problem of ``skin``; the previous one as far as its settings are the same."""
    problem = previous.problem
    if not _same_difference(skin, previous.skin):
        return _problem(previous.model, skin)
    if skin.inverse.record("prior") == previous.skin.inverse.record("prior"):
        return problem
    penalty = skin.inverse.record("prior").penalty(previous.mesh, problem.jacobian)
    return replace(problem, prior=penalty)


def colour_limit(prepared: Prepared) -> float:
    """End of the symmetric scale, in the image's unit, rounded up to 1, 2 or 5.

    The largest change that the operator shows for a round touch of 15 mm radius in the middle
    of the sheet that takes away all of its conductivity, by the linear model.
    """
    mesh, skin = prepared.mesh, prepared.skin
    middle = mesh.volumes @ mesh.centroids / mesh.volumes.sum()
    distance = np.linalg.norm(mesh.centroids - middle, axis=1)
    touched = distance <= max(_RADIUS, float(distance.min()))
    change = np.where(touched, -skin.conductivity, 0.0)
    dv = (prepared.problem.jacobian @ change).real
    return _rounded(float(np.abs(prepared.operator(dv).values).max()))


def _prepared(skin: Skin, problem: LinearProblem, previous: Prepared | None = None) -> Prepared:
    """``previous``: the same body with other settings; what is the same serves again."""
    model = problem.model
    scan = Scan.of(model.pattern)
    readout = Readout.of(scan, skin.readout)
    same = previous is not None and previous.problem is problem
    reach("image")
    light_touch, choice, operator = _chosen(
        problem, skin, readout, previous.light_touch if previous and same else None
    )
    segmenter = previous.segmenter if previous and previous.skin.touch == skin.touch else None
    calibrations = previous.calibrations if previous else {}
    spots = None
    reach("touches")
    if _fits(skin, calibrations):
        kept = previous.spots if previous and _same_spots(previous.skin, skin) else None
        spots = kept or SpotModel.of(skin, model)
    made = Prepared(
        skin=skin,
        mesh=model.mesh,
        pattern=model.pattern,
        scan=scan,
        model=model,
        problem=problem,
        operator=operator,
        modes=None,
        segmenter=segmenter or Segmenter(model.mesh, skin.touch),
        readout=readout,
        choice=choice,
        light_touch=light_touch,
        spots=spots,
        calibrations=calibrations,
    )
    if not skin.inverse.time_constant:
        return made
    spectrum = light_touch.spectrum if light_touch else Spectrum.of(problem)
    return made.with_alpha(choice, spectrum, operator)


def _fits(skin: Skin, calibrations: Mapping[str, Calibration[Any]]) -> bool:
    """Whether anything is fitted to the data: touches, or what a calibration needs."""
    return skin.touch.method == "fit" or any(c.kind.fits for c in calibrations.values())


def _same_difference(one: Skin, other: Skin) -> bool:
    return one.inverse.difference == other.inverse.difference


def _same_spots(one: Skin, other: Skin) -> bool:
    return _same_difference(one, other) and one.touch.sign == other.touch.sign


def image_method(skin: Skin) -> Method | None:
    """What makes the skin's images where it is not one step."""
    method: Method | None = None
    if skin.inverse.method in METHODS:
        method = skin.inverse.record("method")
    return method


def _chosen(
    problem: LinearProblem, skin: Skin, readout: Readout, light_touch: LightTouch | None
) -> tuple[LightTouch | None, AlphaChoice, Operator]:
    if (method := image_method(skin)) is not None:
        made = method.operator(problem.model, skin.conductivity, problem.difference)
        return None, *made
    alpha = skin.inverse.alpha
    if not isinstance(alpha, str):
        by_hand = AlphaChoice(alpha, "hand", "set by hand")
        return None, by_hand, problem.operator(alpha)
    light_touch = light_touch or LightTouch.of(Spectrum.of(problem))
    choice = light_touch(_predicted(problem, readout))
    choice = replace(choice, reason=f"{choice.reason}, as its read-out predicts it")
    return light_touch, choice, light_touch.spectrum.operator(choice.alpha)


def _predicted(problem: LinearProblem, readout: Readout) -> FloatArray:
    rows = np.full(len(problem.reference), readout.noise)
    return difference_noise(rows, problem.reference, problem.difference)


def _rounded(value: float) -> float:
    if not value > 0:
        return 1.0
    decade = 10.0 ** math.floor(math.log10(value))
    return next(step * decade for step in (1, 2, 5, 10) if value <= step * decade * (1 + 1e-9))
