"""Some seconds of what ``make fuzz`` does for long: mutated streams through the host's parser."""

from board.wire.streams import fuzz


def test_nothing_wrong_is_accepted_and_the_second_frame_behind_is_found():
    tally = fuzz(30_000, seed=5)
    assert tally.streams == 30_000
    assert tally.corrupt > 5_000
    assert tally.late == 0
    assert tally.wrong <= 3  # 2^-16 of the corrupt ones: fewer than one is expected
