"""Events that come again and again are counted, and none is lost."""

import itertools
import re

from hypothesis import given, strategies as st

from tomoskin.core import Event
from tomoskin.run.intake import PERIOD, Repeats


def times(text):
    """How many events a text stands for."""
    found = re.search(r"\((\d+) times\)$", text)
    return int(found[1]) if found else 1


@given(st.lists(st.tuples(st.floats(0, 3), st.sampled_from("abc")), max_size=60))
def test_every_event_is_counted_once(happened):
    repeats, said = Repeats(), []
    for now, text in sorted(happened):
        said += [(now, event) for event in repeats.push(now, [Event(now, "fault", text)])]
    said += [(9.0, event) for event in repeats.push(9.0, [])]
    for text in "abc":
        mine = [(now, event) for now, event in said if event.text.startswith(text)]
        assert sum(times(event.text) for _, event in mine) == sum(t == text for _, t in happened)
        moments = [now for now, _ in mine]
        assert all(b - a >= PERIOD for a, b in itertools.pairwise(moments))


def test_a_flood_is_two_lines():
    repeats = Repeats()
    flood = [Event(0.001 * n, "fault", "off") for n in range(900)]
    said = [event.text for event in flood for event in repeats.push(event.host_time, [event])]
    said += [event.text for event in repeats.push(5.0, [])]
    assert said == ["off", "off (899 times)"]


def test_a_clock_that_is_set_back_hides_nothing():
    repeats = Repeats()
    assert list(repeats.push(100.0, [Event(100.0, "fault", "off")]))
    assert list(repeats.push(1.0, [Event(1.0, "fault", "off")]))
