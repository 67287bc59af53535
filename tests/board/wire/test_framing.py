"""COBS, CRC and the line format."""

from hypothesis import given, strategies as st

from tomoskin.board.wire import crc16
from tomoskin.board.wire.framing import cobs_decode, cobs_encode, enclose


def test_crc_check_value():
    assert crc16(b"123456789") == 0x29B1


def test_cobs_examples_of_the_paper():
    assert cobs_encode(b"") == b"\x01"
    assert cobs_encode(b"\x00") == b"\x01\x01"
    assert cobs_encode(b"\x11\x22\x00\x33") == b"\x03\x11\x22\x02\x33"
    run = bytes(range(1, 255))
    assert cobs_encode(run) == b"\xff" + run
    assert cobs_encode(run + b"\xff") == b"\xff" + run + b"\x02\xff"
    assert cobs_encode(b"\x00" + run) == b"\x01\xff" + run


@given(st.binary(max_size=1500) | st.lists(st.sampled_from([0, 1, 255]), max_size=1100).map(bytes))
def test_cobs_round_trip_without_zeros(data):
    encoded = cobs_encode(data)
    assert 0 not in encoded
    assert len(encoded) <= len(data) + 1 + len(data) // 254
    assert cobs_decode(encoded) == data


@given(st.integers(250, 520), st.booleans())
def test_cobs_round_trip_around_full_runs(length, closed):
    data = b"\x07" * length + (b"\x00" if closed else b"")
    assert cobs_decode(cobs_encode(data)) == data


@given(st.binary(max_size=600))
def test_cobs_decode_takes_anything(data):
    assert cobs_decode(data) is None or 0 not in data


def test_cobs_refuses_what_does_not_add_up():
    assert cobs_decode(b"") is None
    assert cobs_decode(b"\x03\x11") is None
    assert cobs_decode(b"\x02\x00") is None


def test_line_format_is_payload_checksum_zero():
    payload = b"\x82\x07"
    body = payload + crc16(payload).to_bytes(2, "big")
    assert enclose(payload) == cobs_encode(body) + b"\x00"
    assert crc16(body) == 0
