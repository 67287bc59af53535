"""A bad line: what is lost, altered and late, and that the host gets on with it."""

import numpy as np
import pytest

from tomoskin.board.wire import Decoder, encode
from tomoskin.core import Frame, ModelError
from tomoskin.twin import Line, LineSettings

SENT = np.random.default_rng(0).integers(0, 256, 20_000).astype(np.uint8).tobytes()


def test_a_perfect_line_changes_nothing():
    assert Line(LineSettings(), 1).carry(SENT) == SENT


def test_loss_has_its_rate_and_keeps_the_order():
    arrived = Line(LineSettings(loss=0.05), 1).carry(SENT)
    assert len(arrived) == pytest.approx(0.95 * len(SENT), rel=0.01)
    walk = iter(SENT)
    assert all(byte in walk for byte in arrived)


def test_corruption_flips_one_bit_at_its_rate():
    arrived = Line(LineSettings(corruption=0.02), 1).carry(SENT)
    flips = np.frombuffer(arrived, np.uint8) ^ np.frombuffer(SENT, np.uint8)
    assert (flips != 0).mean() == pytest.approx(0.02, rel=0.2)
    assert np.bitwise_count(flips).max() == 1


def test_what_is_held_back_comes_with_the_next():
    line = Line(LineSettings(hold=0.5), 3)
    chunks = [SENT[k : k + 100] for k in range(0, 2000, 100)]
    arrived = [line.carry(chunk) for chunk in chunks]
    assert b"" in arrived
    assert max(map(len, arrived)) >= 200
    assert SENT.startswith(b"".join(arrived))


@pytest.mark.parametrize("later", [b"", SENT[100:200]])
def test_what_is_held_back_comes_when_the_line_is_mended(later):
    line = Line(LineSettings(hold=0.999), 3)
    assert line.carry(SENT[:100]) == b""
    line.settings = LineSettings()
    assert line.carry(later) == SENT[:100] + later


def test_the_seed_decides():
    settings = LineSettings(loss=0.1, corruption=0.1)
    one, same, other = (Line(settings, seed).carry(SENT) for seed in (1, 1, 2))
    assert one == same != other


def test_a_frame_that_suffered_is_counted_and_the_others_are_whole():
    frames = [
        Frame(k, 1000 * k, 0.0, 7, 0, 0, np.arange(48, dtype=np.uint16) + k) for k in range(400)
    ]
    line = Line(LineSettings(loss=5e-4, corruption=5e-4), 2)
    decoder, heard = Decoder(), []
    for frame in frames:
        heard += decoder.feed(line.carry(encode(frame)), 0.0)
    whole = [m for m in heard if isinstance(m, Frame)]
    assert 300 < len(whole) < 400
    for frame in whole:
        assert frame.samples.tolist() == frames[frame.sequence].samples.tolist()
    assert decoder.counters.corrupt >= 1


@pytest.mark.parametrize("name", ["loss", "corruption", "hold"])
@pytest.mark.parametrize("value", [-0.1, 1.0, float("nan")])
def test_impossible_rates(name, value):
    with pytest.raises(ModelError, match=f"{name} from 0 to below 1"):
        LineSettings(**{name: value})
