"""Every kind of fault of a script, seen in what is recorded while it lasts, and only then."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from run.scripted import FRAME, SKIN, fault, run
from tomoskin.board.wire import FrameFlag
from tomoskin.core import Frame
from tomoskin.files.session import SessionReader
from tomoskin.model.pattern import Scan
from tomoskin.run.scripted import Simulated

LEAD_IN, START, END = 0.5, 0.3, 0.7
SCAN = Scan.of(SKIN.pattern())
SUMMED = SKIN.readout.oversampling
FULL = (1 << SKIN.readout.adc_bits) - 1
SPAN = {"start": f"{START} s", "end": f"{END} s"}


@dataclass(frozen=True)
class Seen:
    """Frames of a run, and which of them were scanned while the fault lasted."""

    simulated: Simulated
    frames: list[Frame]
    raw: bytes

    @property
    def counts(self) -> np.ndarray:
        """(n_frames, n_samples) means of the conversions."""
        return np.array([frame.samples for frame in self.frames]) / SUMMED

    @property
    def within(self) -> np.ndarray:
        """(n_frames,)."""
        begun = np.array([frame.host_time for frame in self.frames]) - FRAME
        begun -= self.frames[0].host_time - FRAME
        return (begun > LEAD_IN + START) & (begun < LEAD_IN + END - FRAME)

    @property
    def before(self) -> np.ndarray:
        """(n_frames,)."""
        return np.arange(len(self.frames)) < LEAD_IN / FRAME

    def change(self) -> np.ndarray:
        """(n_samples,) mean counts while it lasts less those before."""
        return self.counts[self.within].mean(axis=0) - self.counts[self.before].mean(axis=0)


@pytest.fixture(scope="module")
def seen(tmp_path_factory: pytest.TempPathFactory):
    """Run a script with one fault."""

    def made(*happens: str) -> Seen:
        out = tmp_path_factory.mktemp("faults") / "a.mcap"
        simulated = run(out, f"{LEAD_IN} s", *happens)
        with SessionReader(out) as session:
            frames = [item.frame for item in session.frames()]
            raw = b"".join(data for _, data in session.raw())
        return Seen(simulated, frames, raw)

    return made


@pytest.fixture(scope="module")
def well(seen) -> Seen:
    """Nothing goes wrong."""
    return seen()


def same_outside(found: Seen, well: Seen) -> None:
    """The noise is drawn alike, so that every frame before the fault is the same to the bit."""
    n = int(np.argmax(found.within)) - 1
    assert (found.counts[:n] == well.counts[:n]).all()
    assert np.abs(found.counts[-2:] - well.counts[-2:]).max() < 2.0


@pytest.mark.parametrize("kind", ["cut", "rail"])
def test_a_channel_that_stands_at_its_rail(seen, well: Seen, kind: str) -> None:
    found = seen(fault(kind, **SPAN, electrode=2))
    mine = SCAN.sample_electrode == 2
    assert found.counts[found.within][:, mine].min() > FULL - 1
    same_outside(found, well)
    driven = (SCAN.drives[SCAN.sample_drive] == 2).any(axis=1)
    others = np.abs(found.change()[~mine & ~driven])
    assert others.max() < 2.0
    hurt = np.abs(found.change()[~mine & driven])
    assert (hurt.max() > 100) == (kind == "cut")  # a wire that is cut drives nothing either


def test_two_electrodes_that_touch(seen, well: Seen) -> None:
    found = seen(fault("short", **SPAN, electrode=3, other=4))
    between = (np.sort(SCAN.drives[SCAN.sample_drive], axis=1) == (3, 4)).all(axis=1)
    spread = np.ptp(found.counts[:, between], axis=1)
    assert spread[found.within].max() < 0.1 * spread[found.before].min()
    same_outside(found, well)


def test_a_noisy_converter(seen, well: Seen) -> None:
    found = seen(fault("noise", **SPAN, lsb=20.0))
    formula = np.sqrt((20.0**2 + 1 / 12) / SUMMED)
    inside = (SCAN.sample_drive >= 0) & (np.abs(well.counts.mean(axis=0) - FULL / 2) < FULL / 4)
    noise = found.counts[found.within][:, inside].std(axis=0, ddof=1)
    assert np.sqrt((noise**2).mean()) == pytest.approx(formula, rel=0.25)
    quiet = found.counts[found.before][:, inside].std(axis=0, ddof=1)
    assert np.sqrt((quiet**2).mean()) < 0.1 * formula
    same_outside(found, well)


def test_a_warmer_sheet(seen, well: Seen) -> None:
    found = seen(fault("temperature", f"{START} s", kelvin=10.0))
    late = np.arange(len(found.frames)) > (LEAD_IN + START) / FRAME + 2
    rows = [counts[:, SCAN.plus] - counts[:, SCAN.minus] for counts in (found.counts, well.counts)]
    warm, cold = (values[late].mean(axis=0) for values in rows)
    assert (warm @ cold) / (cold @ cold) == pytest.approx(1 + 0.0038 * 10, abs=0.002)
    assert (found.counts[: len(found.frames) // 3] == well.counts[: len(found.frames) // 3]).all()


@pytest.mark.parametrize("kind", ["loss", "corruption"])
def test_bytes_that_are_lost_or_altered(seen, well: Seen, kind: str) -> None:
    found = seen(fault(kind, **SPAN, probability=0.01))
    assert 0 < found.simulated.lost < 9  # a frame has some 110 bytes, seven frames are at stake
    whole = {frame.sequence: frame.samples for frame in well.frames}
    assert all((frame.samples == whole[frame.sequence]).all() for frame in found.frames)
    gaps = np.diff([frame.sequence for frame in found.frames]) - 1
    assert gaps.sum() == found.simulated.lost
    if kind == "loss":
        assert len(found.raw) < len(well.raw)
    else:
        assert len(found.raw) == len(well.raw)
        assert found.raw != well.raw


def test_bytes_that_come_late(seen, well: Seen) -> None:
    found = seen(fault("delay", **SPAN, probability=0.6))
    assert found.raw == well.raw
    assert found.simulated.lost == 0
    assert [frame.ticks for frame in found.frames] == [frame.ticks for frame in well.frames]
    times = [[frame.host_time for frame in run.frames] for run in (found, well)]
    assert len(set(times[1])) == len(times[1])
    assert len(set(times[0])) < len(times[0])  # two came at once


def test_a_board_that_loses_its_power_scans_again(seen, well: Seen) -> None:
    found = seen(fault("reboot", f"{START} s"))
    firsts = [frame.sequence for frame in found.frames if frame.flags & FrameFlag.FIRST]
    assert firsts == [0, 0]
    numbers = [frame.sequence for frame in found.frames]
    again = numbers.index(0, 1)
    assert again == pytest.approx((LEAD_IN + START) / FRAME, abs=2)
    assert len(found.frames) > again + 3
    assert np.abs(found.counts[-1] - well.counts[-1]).max() < 2.0
