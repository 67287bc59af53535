"""One concept of calibration: what is learnt from examples, kept in a file, and applied to frames.

A kind says what its model is learnt from, how it is checked, how it is applied, and how what it
reads is shown; files, sessions, the pipeline, the page and the command line go through the kinds
and know none of them by name. A further kind is a :class:`Kind` that is registered at the seam
"calibrations".

Keys of a file, an .npz: ``kind``, ``version``; ``drive``, ``measure`` (n_meas, 2),
``n_electrodes``; ``skin_name``; and what the kind's model is learnt from. It is learnt again when
the file is read, which gives the same model: a file outlives the method.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, replace
from inspect import signature
from typing import Any, ClassVar, Generic, Literal, Protocol, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import (
    MOST_ELECTRODES,
    Arrays,
    DataError,
    Detection,
    FloatArray,
    Image,
    IntArray,
    ModelError,
    PatternError,
    StrPath,
    electrode_table,
    load_arrays,
    located,
    pack_arrays,
    save_arrays,
    unpack_arrays,
    whole_number,
)
from tomoskin.learning.record_arrays import pack, unpack
from tomoskin.model.pattern import Pattern
from tomoskin.model.skin import Skin
from tomoskin.sensing.fit import Response
from tomoskin.sensing.segment import ImageNoise

BoolArray = NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class Differences:
    """What one frame differs by from the untouched skin.

    Attributes
    ----------
    dv
        (n_meas,) difference data without their part in the nuisance subspace.
    nuisance
        (n_meas, k) directions of the difference data that carry no information.
    whole
        (n_meas,) difference data with their part in the common modes.
    unknown
        (n_meas, k) directions along which these carry no information.
    jumps
        (n_meas, j) common modes, each as long as the deviation of what it may jump by.
    change
        (n_meas,) V by which the frame differs from the baseline, with all that is in it.
    drift
        (n_meas, k) V: directions of drift and of excluded measurements.
    from_rest
        (n_meas,) V by which it differs from the reference as that was taken.
    excluded
        (n_meas,) bool: measurements that do not count.
    wander
        Deviation of what the first common mode may have moved by since the baseline was followed,
        as a part of its jump.
    """

    dv: FloatArray
    nuisance: FloatArray
    whole: FloatArray
    unknown: FloatArray
    jumps: FloatArray
    change: FloatArray
    drift: FloatArray
    from_rest: FloatArray
    excluded: BoolArray
    wander: float = 0.0

    @classmethod
    def of(cls, change: FloatArray, jumps: FloatArray, excluded: BoolArray) -> Differences:
        """A ``change`` (n_meas,) V in which nothing drifts; see the attributes for the others."""
        unknown = np.eye(len(change))[:, excluded]
        return cls(
            dv=change,
            nuisance=np.hstack([jumps, unknown]),
            whole=change,
            unknown=unknown,
            jumps=jumps,
            change=change,
            drift=np.zeros((len(change), 0)),
            from_rest=change,
            excluded=excluded,
        )

    @property
    def since_reference(self) -> FloatArray:
        """(n_meas,) V by which it differs from that reference, NaN where excluded."""
        return np.where(self.excluded, np.nan, self.from_rest)


@dataclass(frozen=True, slots=True, eq=False)
class FrameView:
    """What one frame shows.

    Attributes
    ----------
    time
        s.
    image, image_noise
        The image; and what computes its noise, where that is known.
    differences
        What it was made of.
    others
        (k, n_meas) V: for each of the k detections that were fitted, what all others change. None
        where detections are regions of the image.
    """

    time: float
    image: Image
    image_noise: Callable[[], ImageNoise | None]
    differences: Differences
    others: FloatArray | None = None


Detect = Callable[[FrameView, list[Detection]], list[Detection]]
"""Touches fitted to the data of a frame, given those that the skin's own method found."""


@dataclass(frozen=True, slots=True, eq=False)
class TouchFit:
    """Touches on the forward model: its ``response``; the ``gain`` of measured against modelled
    voltages; ``detect``, which fits them to a frame."""

    response: Response
    gain: float
    detect: Detect


@dataclass(frozen=True, slots=True)
class ShownReading:
    """What the page shows of a reading.

    Attributes
    ----------
    words
        What was read, in a few words; ``wrong``: someone must look.
    sentence
        The same for who hears it, or points at it.
    place
        Where it is shown: beside the ``sheet``, or above the list of ``touches``.
    unit, value, deviation
        A figure in large type, what it is, and how sure; "" where there is none.
    drawn
        Angle and axis, rad, of the bent sheet that is drawn below it; None: none is.
    notes
        Lines below that.
    """

    words: str
    sentence: str
    place: Literal["sheet", "touches"]
    wrong: bool = False
    unit: str = ""
    value: str = ""
    deviation: str = ""
    drawn: tuple[float, float] | None = None
    notes: tuple[str, ...] = ()


class Reading(ABC):
    """What a calibration reads in one frame beside its touches, and how it is shown.

    ``key``: its name in what is said of a run; ``listed``: that of all of a recording's.
    ``problem``: what is wrong, in a sentence, or None.
    """

    key: ClassVar[str]
    listed: ClassVar[str]
    problem: str | None = None

    @property
    @abstractmethod
    def text(self) -> str:
        """In words, for one line of a report."""

    @property
    @abstractmethod
    def word(self) -> str:
        """What frames are counted by."""

    @property
    @abstractmethod
    def facts(self) -> dict[str, Any]:
        """For programs that read a recording."""

    @property
    def now(self) -> dict[str, Any]:
        """For programs that watch a run."""
        return self.facts

    @property
    @abstractmethod
    def shown(self) -> ShownReading:
        """For the page."""

    @property
    def is_rest(self) -> bool:
        """Whether a reference may be taken of such a frame."""
        return True


class Conditions(Protocol):
    """Under which a calibration is applied, from one reference on."""

    @property
    def fitted(self) -> bool:
        """Whether detections are touches that were fitted to the data."""
        ...

    @property
    def unrelated(self) -> bool:
        """Whether frames are no course in time, so that none tells of another."""
        ...

    def fitted_presses(self, dv: FloatArray) -> list[Detection | None] | None:
        """What the fit finds in each frame (n, n_meas) V of one press; None where none is."""
        ...

    def touch_fit(self) -> TouchFit | None:
        """The fit of touches beside the calibration; None where no reference is known."""
        ...


class Applied:
    """What a calibration does with each frame; a kind overrides what it needs.

    ``moved`` V, or (n_meas,) V: what of the newest frame the baseline must not learn. ``poses``
    (p, n_meas) V: by how much a body may move it. ``slide_lag`` m: by which the sheet lags behind
    a finger that slides.
    """

    moved: FloatArray | float = 0.0
    poses: FloatArray = np.zeros((0, 0))
    slide_lag: float = 0.0

    def locate(self, view: FrameView, detections: list[Detection]) -> list[Detection]:
        """Detections with better positions."""
        del view
        return detections

    def renew(self, response: Response, gain: float) -> None:
        """Go on with touches that are fitted on another sheet; see :class:`TouchFit`."""

    def read(self, view: FrameView, detections: list[Detection], *, touched: bool) -> Any | None:
        """What the frame says of the calibration's subject.

        ``touched``: whether a touch stands, by one who has tracked the frames before.
        """
        del view, detections, touched
        return None


Progress = Callable[[float, float], None]
"""Called with how much of how much is done."""

M = TypeVar("M")

_PATTERN_KEYS = frozenset({"version", "drive", "measure", "n_electrodes"})
_VERSION = 1
_GIVEN = {"pattern", "progress"}
"""Parameters of a kind's ``learn`` that no file holds under their names."""


def silent(_done: float, _total: float) -> None:
    """Take the progress of a fit and report nothing."""


@dataclass(frozen=True, eq=False)
class Kind(Generic[M]):
    """One kind of calibration, whose model is an M.

    Attributes
    ----------
    name
        Its key among :func:`tomoskin.learning.calibration_kinds`, and the sub-command of
        ``tomoskin calibrate`` that makes one.
    title
        What its file says that it is.
    subject
        What it calibrates, for messages.
    attachment
        Name of its file inside a session.
    learn
        What its file holds → model, learnt again; raises DataError. Its parameters name the
        attributes of the model that the file holds, beside a ``pattern`` and a ``progress`` where
        it asks for them; their annotations say how they are read (:mod:`.record_arrays`).
    exclude
        Model without some measurements; None where it cannot do without.
    apply
        Model and conditions → what it does with each frame.
    check
        Raises DataError where a calibration cannot serve a skin of its own scan; None where it
        always can.
    directions
        Model → (n_meas, k) V along which what it reads moves the data: images do without them.
        None where it reads nothing of that sort.
    reading
        What it reads in frames that is shown; None where that is nothing.
    locates
        Whether its positions stand in for those of the detections.
    fits
        Whether it needs touches fitted to the data of each frame.
    own_settings
        Whether it serves only the skin that it was learnt on, with the settings that it had.
    """

    name: str
    title: str
    subject: str
    attachment: str
    learn: Callable[..., M]
    exclude: Callable[[M, IntArray], M | None]
    apply: Callable[[M, Conditions], Applied]
    check: Callable[[Calibration[M], Skin], None] | None = None
    directions: Callable[[M], FloatArray] | None = None
    reading: type[Reading] | None = None
    locates: bool = False
    fits: bool = False
    own_settings: bool = False

    def of(self, model: M, pattern: Pattern, skin: Skin | None = None) -> Calibration[M]:
        """A calibration of this kind, of the measurements of ``pattern``."""
        return Calibration(self, model, pattern, skin.name if skin else "")

    def read(self, path: StrPath, progress: Progress = silent) -> Calibration[M]:
        """Read a file of this kind and learn from its examples again.

        Raises
        ------
        DataError
            When it is missing, damaged, or of another kind.
        """
        return self.unpack(load_arrays(path), str(path), progress)

    def decode(self, data: bytes, where: str) -> Calibration[M]:
        """:meth:`read` from the file's bytes."""
        return self.unpack(unpack_arrays(data, where), where)

    def unpack(self, arrays: Arrays, where: str, progress: Progress = silent) -> Calibration[M]:
        """:meth:`read` from the arrays of the file."""
        pattern = self._pattern(arrays, where)
        with located(where, DataError, DataError, ModelError, PatternError):
            rows = arrays["dv"].shape[1:] if "dv" in arrays else (pattern.n_meas,)
            if rows != (pattern.n_meas,):
                raise DataError(f"expected {pattern.n_meas} rows of dv, got {rows}")
            model = unpack(self.learn, arrays, pattern=pattern, progress=progress)
        return Calibration(self, model, pattern, str(arrays.get("skin_name", "")))

    def pack(self, model: M) -> dict[str, NDArray[Any]]:
        """What its file holds of a ``model``."""
        kept = [name for name in signature(self.learn).parameters if name not in _GIVEN]
        return pack({name: getattr(model, name) for name in kept})

    def _pattern(self, arrays: Arrays, where: str) -> Pattern:
        title = str(arrays.get("kind", ""))
        if title != self.title or not set(arrays) >= _PATTERN_KEYS:
            raise DataError(
                f"is not a calibration of {self.subject}",
                where=where,
                hint=f"make one: tomoskin calibrate {self.name}",
            )
        if whole_number(arrays, "version", where) != _VERSION:
            raise DataError(f"expected version {_VERSION}, got {arrays['version']}", where=where)
        drive, measure = (electrode_table(arrays, key, where) for key in ("drive", "measure"))
        with located(where, DataError, DataError, ModelError, PatternError):
            n_electrodes = whole_number(arrays, "n_electrodes", where, MOST_ELECTRODES)
            return Pattern.from_tables(drive, measure, n_electrodes)


@dataclass(frozen=True, eq=False)
class Calibration(Generic[M]):
    """A ``model`` of one ``kind``, the pattern of its measurements and the name of its skin.

    ``skin_name`` is "" where there is no skin.
    """

    kind: Kind[M]
    model: M
    pattern: Pattern
    skin_name: str = ""

    def write(self, path: StrPath, *, overwrite: bool = False) -> None:
        """Write the file; raises as :func:`tomoskin.core.user_files` does."""
        save_arrays(path, self._arrays(), overwrite=overwrite)

    def encode(self) -> bytes:
        """The same file's bytes, for a session that holds it."""
        return pack_arrays(self._arrays())

    def check(self, skin: Skin) -> None:
        """Raise DataError where it cannot serve ``skin``: of another scan, or as its kind says."""
        if skin.pattern().identity != self.pattern.identity:
            raise self.mismatch("scan", skin)
        if self.kind.check is not None:
            self.kind.check(self, skin)

    def check_skin(self, skin: Skin) -> None:
        """Raise DataError where it was learnt on another skin, or on other settings of it."""
        learnt_on = getattr(self.model, "skin_id", "")
        if learnt_on and learnt_on != skin.identity:
            raise self.mismatch("skin", skin)

    def mismatch(self, what: str, skin: Skin) -> DataError:
        """That it was learnt on another ``what`` than that of ``skin``, by their names."""
        mine = f'"{self.skin_name}"' if self.skin_name else "a skin without a name"
        other = f'"{skin.name}"' + (", with other settings" if skin.name == self.skin_name else "")
        return DataError(
            f"the calibration of {self.kind.subject} belongs to another {what}: it was learnt on "
            f"{mine} and is used on {other}",
            hint=f"calibrate this skin: tomoskin calibrate {self.kind.name}",
        )

    def with_model(self, model: M) -> Self:
        """The same with another model."""
        return replace(self, model=model)

    def without(self, measurements: IntArray) -> Self | None:
        """The same without some measurements; None where it cannot do without."""
        model = self.kind.exclude(self.model, measurements)
        return None if model is None else self.with_model(model)

    def apply(self, conditions: Conditions) -> Applied:
        """What it does with each frame under ``conditions``."""
        return self.kind.apply(self.model, conditions)

    def _arrays(self) -> Arrays:
        return {
            "kind": np.array(self.kind.title),
            "version": np.array(_VERSION),
            "drive": self.pattern.drive,
            "measure": self.pattern.measure,
            "n_electrodes": np.array(self.pattern.n_electrodes),
            "skin_name": np.array(self.skin_name),
            **self.kind.pack(self.model),
        }
