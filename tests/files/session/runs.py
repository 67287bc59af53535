"""Small runs for tests: frames of a skin without a pipeline."""

from __future__ import annotations

import numpy as np

from tomoskin.board.wire import Info, Reset, encode
from tomoskin.core import Detection, Event, Frame, Image, Mark, Touch
from tomoskin.files.session import SessionWriter
from tomoskin.model.pattern import Scan
from tomoskin.model.skin import Skin
from tomoskin.sensing.fit import Deformation, EstimatedNumber

SKIN = Skin.load("textile-disc-8")
SCAN = Scan.of(SKIN.pattern())
PRESS = {"x": 0.01, "y": -0.02, "force": 3.0, "radius": 0.012, "shape": "round"}
INFO = Info(
    request=3,
    major=1,
    minor=0,
    schema_hash=7,
    firmware=bytes((1, 2, 3)),
    reset=Reset.POWER,
    channels=8,
    adc_bits=10,
    max_oversampling=64,
    max_drives=128,
    max_samples=2000,
    tick_rate=16_000_000,
    current=1000,
    max_baud=1_000_000,
    unique_id=bytes(range(8)),
)
FOLD = Deformation(
    kind="fold",
    amount=EstimatedNumber(0.35, 0.3, 0.4),
    unit="rad",
    axis=EstimatedNumber(0.5, 0.4, 0.6),
    offset=EstimatedNumber(0.02, 0.015, 0.025),
    width=EstimatedNumber(0.06, 0.04, 0.09),
)
STRETCH = Deformation(
    kind="stretch",
    amount=EstimatedNumber(0.03, 0.02, 0.04),
    unit="strain",
    axis=EstimatedNumber(1.5, 1.4, 1.6),
    across=EstimatedNumber(0.01, 0.0, 0.02),
    confused="a sheet wrapped round a cylinder across it",
)
TOUCH = Touch(
    4, "decrease", 0.25, Detection(0.1, -0.2, 1e-3, float("nan"), 3e-4, -0.5, np.empty(0))
)


def frame_of(number, *, rate=100.0, seed=0, n_samples=SCAN.n_samples):
    """Frame ``number`` of a run: the same for the same arguments."""
    rng = np.random.default_rng((seed, number))
    return Frame(
        sequence=number,
        ticks=round(number / rate * INFO.tick_rate),
        host_time=number / rate + 1e-9 * number**2,  # not a whole number of ns
        configuration=0x1A2B,
        flags=int(number == 0),
        drops=0,
        samples=rng.integers(200, 3000, n_samples).astype("<u2"),
    )


def write_frames(path, count, *, since=0, rate=100.0):
    """A session of ``count`` frames with their raw bytes, and nothing else."""
    with SessionWriter(path, SKIN) as session:
        for number in range(since, since + count):
            put(session, frame_of(number, rate=rate))
    return path


def put(session, frame, mark=Mark.NONE):
    """Raw bytes and frame, as a recorder writes them."""
    session.raw(frame.host_time, encode(frame))
    session.frame(frame, mark)


def write_all(path, *, reference=(5, 1)):
    """A session with something in every channel; frame and length of its ``reference``."""
    begins, frames = reference
    with SessionWriter(path, SKIN, epoch=1e9) as session:
        session.settings(0.0, {"source": "twin", "reference_frames": frames})
        session.device(0.0, INFO)
        session.truth(0.0, ())
        session.event(Event(0.0, "connected", "board 01"))
        for number in range(30):
            if number == 10:
                session.truth(frame_of(9).host_time + 1e-6, (PRESS,))
                session.note(0.1, "pressed")
            put(session, frame_of(number), Mark.REFERENCE if number == begins else Mark.NONE)
        session.touches(frame_of(20).host_time, 20, (TOUCH,))
        mesh = SKIN.mesh()
        values = np.linspace(-1, 1, len(mesh.cells))
        session.image(0.2, Image(values, "S", mesh.identity), mesh.pixels(48), (TOUCH,))
        session.clock(0.3, {"tick_rate": 16e6, "offset": 0.0, "residual": 1e-6, "frames": 30})
        session.attach("calibration.json", "application/json", b"{}")
    return path


def same_frame(a, b):
    """Whether two frames are the same to the bit."""
    names = ("sequence", "ticks", "host_time", "configuration", "flags", "drops")
    return all(getattr(a, n) == getattr(b, n) for n in names) and np.array_equal(
        a.samples, b.samples
    )
