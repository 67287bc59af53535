"""What all flows have in which someone presses the skin and the page says what that tells."""

from __future__ import annotations

import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, Literal

import numpy as np

from tomoskin.core import FloatArray, TomoskinError, WireError, watch_stages
from tomoskin.learning import Kind
from tomoskin.pipeline import FrameResult, Prepared
from tomoskin.run import Runner, commands
from tomoskin.sensing.segment import Region
from tomoskin.server.folder import Folder
from tomoskin.server.page_messages import Figures, FlowNow, Point
from tomoskin.server.requests import DeletePress

_FILLED, _INSIDE = 0.6, 0.85
"""Parts of the way to the rim that dots stay within: those that fill the sheet, since presses all
round the rim teach little at first (the twin's textile disc, ten presses: missed by 12 mm instead
of 51), and all others, since a finger does not press half a sheet."""

_APART = 0.12
"""A dot is no nearer to a press than this, in radii of the sheet: it would tell nothing new."""


Effort = Literal["softly", "hard"]
EFFORTS: tuple[Effort, ...] = ("softly", "hard")
"""How a press is asked for, in turn: presses of one force teach that force alone."""


@dataclass(frozen=True, eq=False)
class GuidedPress:
    """One press: the place m, the change (n_meas,) V that it made, and how it was asked for.

    ``missed``: how far from the place the run itself showed the touch, m; None where it showed
    none.
    """

    place: Point
    dv: FloatArray
    effort: Effort | None = None
    missed: float | None = None


@dataclass(frozen=True, eq=False)
class Estimate:
    """What presses tell so far.

    ``text`` in words; ``place`` (2,) m where a further press tells most, None where that is not
    known; ``ready``: it can be kept; ``figures`` for a page; ``answer`` what is kept.
    """

    text: str
    place: FloatArray | None = None
    ready: bool = False
    figures: Figures = field(default_factory=Figures)
    answer: Any = None


def counted(count: int) -> str:
    """So many presses, for people."""
    return f"{count} press{'' if count == 1 else 'es'}"


class StoppedError(TomoskinError):
    """Nobody waits for the answer any more."""


class GuidedFlow(ABC):
    """One flow. Frames come in a thread of their own, requests in another: :attr:`lock` is held
    for both.

    Attributes
    ----------
    teaches
        The kind of calibration that is kept; None: something else is.
    kind
        What it is for.
    prepared
        The skin.
    estimate, trouble
        What the presses tell, or why that is not known.
    estimating, stage
        Whether something newer is being estimated, and how far that is, in words.
    paused
        Whether frames are left out, because no page shows the flow.
    taken
        What it has recorded: presses, or placed weights.
    answers
        What a page may ask of it, by the type of the request: called with the request, it says
        whether there is something to estimate. WireError refuses.
    """

    kind: ClassVar[str]
    teaches: ClassVar[Kind[Any] | None] = None

    def __init__(self, prepared: Prepared) -> None:
        self.prepared = prepared
        self.estimate: Estimate | None = None
        self.trouble = self.stage = ""
        self.estimating = self.paused = False
        self.answers: dict[type, Callable[[Any], bool]] = {
            DeletePress: lambda request: self.delete(request.number)
        }
        self.taken: list[Any] = []
        self._dots = Dots(prepared)
        self.lock = threading.RLock()
        self._stopped = threading.Event()

    @abstractmethod
    def see(self, result: FrameResult) -> bool | None:
        """Take a frame; whether there is something to estimate, None where nothing is new."""

    @abstractmethod
    def restart(self) -> None:
        """Forget what has begun and is not recorded yet."""

    def examples(self) -> tuple[Any, ...]:
        """What an estimate rests on now."""
        return tuple(self.taken)

    def take_back(self, number: int | None) -> Any:
        """Remove what was recorded ``number``-th, or last; WireError where there is none."""
        number = len(self.taken) - 1 if number is None else number
        if not 0 <= number < len(self.taken):
            raise WireError("there is no press to undo")
        return self.taken.pop(number)

    def delete(self, number: int | None) -> bool:
        """Remove a press as :meth:`take_back` does; whether there is something to estimate."""
        self.take_back(number)
        self.estimate = None
        return True

    @property
    def hint(self) -> str:
        """What is wrong with what is being recorded, and what to do; "" where nothing is."""
        return ""

    @abstractmethod
    def estimate_from(self, examples: tuple[Any, ...]) -> Estimate:
        """What these tell; in a thread. Raises TomoskinError."""

    @abstractmethod
    def details(self) -> dict[str, Any]:
        """What a page shows of it, beside what all flows show."""

    def keep(self, answer: Any, folder: Folder, name: str, runner: Runner) -> str:
        """Save ``answer`` and have the run go on with it; in a thread. The file's name."""
        assert self.teaches is not None
        calibration = self.teaches.of(answer, self.prepared.pattern, self.prepared.skin)
        path = folder.free(name, ".npz")
        calibration.write(path)
        runner.ask(commands.Adopt(runner.prepared.calibrated(calibration)))
        return path.name

    def show(self, *, on: bool) -> None:
        """Go on where a page shows the flow, else pause: nobody would see what is recorded."""
        with self.lock:
            if on and self.paused:
                self.restart()
            self.paused = not on

    def stop(self) -> None:
        """End what is being estimated, soon."""
        self._stopped.set()

    def estimated(self, examples: tuple[Any, ...]) -> Estimate:
        """:meth:`estimate_from`, which :meth:`stop` may end with a StoppedError."""
        self._stopped.clear()

        def reached(_stage: str) -> None:
            if self._stopped.is_set():
                raise StoppedError("stopped")

        with watch_stages(reached):
            return self.estimate_from(examples)

    def now(self) -> FlowNow:
        """What a page shows of the flow."""
        estimate = self.estimate or Estimate("")
        shown: dict[str, Any] = {
            "kind": self.kind,
            "paused": self.paused,
            "thinking": self.estimating,
            "text": self.hint or self.trouble or estimate.text,
            "ready": estimate.ready and not self.estimating,
            "figures": estimate.figures,
        }
        with self.lock:
            return FlowNow(**shown | self.details())


class Dots:
    """Where to press next: where an estimate says, else where nobody has pressed yet.

    ``places``: (n, 2) m where a dot may be.
    """

    def __init__(self, prepared: Prepared) -> None:
        region = Region.of(prepared.skin)
        self._unit = region.unit
        self.places = region.metres(_INSIDE * region.grid)
        self._filled = region.metres(_FILLED * region.grid)

    def next(self, places: Sequence[Point], estimate: Estimate | None) -> Point:
        """(x, y) m of the next dot, after presses at ``places``."""
        pressed = np.array(places).reshape(-1, 2)
        if estimate is not None and estimate.place is not None:
            near = np.argmin(np.linalg.norm(self.places - estimate.place, axis=1))
            place = self.places[near]
            if _gap(pressed, place[None])[0] > _APART * self._unit:
                return float(place[0]), float(place[1])
        if not len(pressed):
            return self._first()
        x, y = self._filled[int(np.argmax(_gap(pressed, self._filled)))].tolist()
        return x, y

    def _first(self) -> Point:
        """Off every axis of the sheet: a press in the middle allows every rotation."""
        middle, extent = self._filled.mean(axis=0), np.ptp(self._filled, axis=0)
        wanted = middle + extent * (0.32, 0.16)
        x, y = self._filled[int(np.argmin(np.linalg.norm(self._filled - wanted, axis=1)))].tolist()
        return x, y


def _gap(pressed: FloatArray, places: FloatArray) -> FloatArray:
    """(n,) m from each of ``places`` (n, 2) to the nearest of ``pressed`` (k, 2)."""
    apart = np.linalg.norm(places[:, None] - pressed, axis=-1)
    return np.asarray(apart.min(axis=1, initial=np.inf))
