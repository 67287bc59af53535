"""Every message there and back, and its bytes."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, strategies as st

from board.wire.messages_strategy import messages, same
from tomoskin.board.wire import (
    Ack,
    Drive,
    GetInfo,
    Hello,
    Ping,
    Result,
    SetOrder,
    SetPattern,
    crc16,
    decode_payload,
    encode,
    encode_payload,
    is_command,
    type_byte,
)
from tomoskin.board.wire.framing import cobs_decode
from tomoskin.core import DriveSamples, Frame, WireError


@given(messages())
def test_round_trip_of_every_message(message):
    block = encode(message)
    assert block.endswith(b"\0")
    assert block.count(b"\0") == 1
    body = cobs_decode(block[:-1])
    assert crc16(body) == 0
    assert same(decode_payload(body[:-2], 0.0), message)


def test_golden_bytes():
    assert encode(GetInfo(1)).hex() == "058101258700"
    assert encode(Hello(1, 0, 0x11223344)).hex()[:16] == "0301010744332211"
    frame = Frame(1, 2, 0.0, 0xBEEF, 1, 0, np.array([0x0102, 0x0304], dtype=np.uint16))
    assert encode_payload(frame).hex() == "10010000000200000000000000efbe01000002010403"
    drive = DriveSamples(1, 2, 0.0, 0xBEEF, 1, 0, 7, 3, 5, np.array([0x0102], dtype=np.uint16))
    assert encode_payload(drive).hex() == "13010000000200000000000000efbe0100000703050201"
    assert encode_payload(drive, packed=True).hex()[-4:] == "0201"
    assert encode_payload(SetOrder(9, 0x1234, 7, b"\5\5\1")).hex() == "9009341207050501"
    pattern = SetPattern(9, 0x1234, 2, (Drive(3, 4, 0x0000FFE7),))
    assert encode_payload(pattern).hex() == "8609341202000304e7ff0000"
    assert encode_payload(Ack(9, 0x86, Result.BUSY, 0)).hex() == "0309860a0000"


def test_frame_takes_the_hosts_time_and_the_samples_are_not_copied():
    samples = np.arange(224, dtype=np.uint16)
    payload = encode_payload(Frame(1, 2, 0.0, 3, 0, 0, samples))
    frame = decode_payload(payload, 12.5)
    assert frame.host_time == 12.5
    assert frame.samples.dtype == np.uint16
    assert not frame.samples.flags.owndata
    assert not frame.samples.flags.writeable


@given(st.lists(st.integers(0, 1023), max_size=300))
def test_packed_samples_come_back(counts):
    frame = Frame(1, 2, 0.0, 3, 1, 4, np.array(counts, dtype=np.uint16))
    payload = encode_payload(frame, packed=True)
    assert len(payload) == 18 + len(counts) + -(-len(counts) // 4)
    assert same(decode_payload(payload, 0.0), frame)


def test_values_that_do_not_fit_are_refused():
    with pytest.raises(WireError, match="PING"):
        encode(Ping(256))
    with pytest.raises(WireError, match="uint16"):
        encode(Frame(0, 0, 0.0, 0, 0, 0, np.array([1.5])))
    with pytest.raises(WireError, match="at most 62 bytes"):
        encode(SetPattern(0, 0, 0, (Drive(0, 1, 2),) * 10))
    with pytest.raises(WireError, match="at most 4096 bytes"):
        encode(Frame(0, 0, 0.0, 0, 0, 0, np.zeros(2100, dtype=np.uint16)))


@pytest.mark.parametrize(
    "payload",
    [
        b"",
        b"\x7f\x00",  # no such type
        b"\x82",  # too short
        b"\x82\x01\x02",  # too long
        b"\x03\x01\x82\x63\x00\x00",  # no such result
        encode_payload(Frame(0, 0, 0.0, 0, 0, 0, np.zeros(1, dtype=np.uint16))) + b"\x01",
        encode_payload(Frame(0, 0, 0.0, 0, 0, 0, np.zeros(4, dtype=np.uint16)), packed=True)
        + b"\0",
        b"\x86\x01\x00\x00\x00\x00\x01\x02\x03",  # half a drive
    ],
)
def test_payloads_of_another_schema_are_none(payload):
    assert decode_payload(payload, 0.0) is None


def test_directions():
    assert is_command(Ping(1))
    assert not is_command(Hello(1, 0, 0))
    assert type_byte(Ping) == 0x82


def test_examples_in_the_document():
    document = (Path(__file__).parents[3] / "docs" / "protocol.md").read_text(encoding="utf-8")
    counts = np.array([512, 1023, 0, 300], dtype=np.uint16)
    frame = Frame(7, 250_000, 0.0, 0x1A2B, 0, 0, counts)
    drive = DriveSamples(7, 250_003, 0.0, 0x1A2B, 0, 0, 0, 1, 1, counts)
    for message, packed in (
        (GetInfo(1), False),
        (Ack(1, 0x87, Result.OK, 0), False),
        (SetPattern(4, 0x1A2B, 0, (Drive(1, 0, 0xFC),)), False),
        (frame, False),
        (frame, True),
        (drive, False),
        (SetOrder(9, 0x1A2B, 7, b"\5\2"), False),
    ):
        payload = encode_payload(message, packed=packed)
        parts = {
            "payload": payload,
            "CRC": crc16(payload).to_bytes(2, "big"),
            "line": encode(message, packed=packed),
        }
        lines = "".join(f"  {name:<8} {part.hex(' ')}\n" for name, part in parts.items())
        assert lines in document
