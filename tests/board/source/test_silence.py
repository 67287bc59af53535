"""Why no board answers: the likeliest cause."""

import pytest

from tomoskin.board.source.serial import BAUD, is_bootloader, likely_cause

BOOTLOADER = bytes.fromhex("1b01000b0e010008") + b"AVRISP_2\x40"
NOISE = bytes(range(128, 200))
MEGA = "Arduino Mega 2560"


@pytest.mark.parametrize(
    ("heard", "bootloader", "board", "rate", "says"),
    [
        (b"", b"", "", BAUD, "probably the wrong port.*ports here"),
        (
            b"",
            b"",
            MEGA,
            BAUD,
            r"\(Arduino Mega 2560\) sends nothing: it probably has no firmware",
        ),
        (b"", BOOTLOADER, MEGA, BAUD, r"in its bootloader.*tomoskin firmware flash /dev/ttyACM0\)"),
        (b"\x1b[2Jtemp 21.5\r\ntemp 21.6\r\n", b"", MEGA, BAUD, r'\("\[2Jtemp 21.5 temp 21.6"\)'),
        (
            NOISE,
            b"",
            MEGA,
            115_200,
            "115,200 Bd .*the rate is probably wrong.*leave out baud=",
        ),
        (NOISE, b"", MEGA, BAUD, "probably another program.*,baud=RATE"),
    ],
)
def test_the_likeliest_cause_and_what_to_do(heard, bootloader, board, rate, says):
    cause = likely_cause(
        "/dev/ttyACM0",
        board,
        rate=rate,
        heard=heard,
        bootloader=bootloader,
        ports="ports here: …",
    )
    assert cause.where == "serial:/dev/ttyACM0"
    with pytest.raises(type(cause), match=says):
        raise cause


def test_a_bootloader_is_known_by_its_answer_alone():
    assert is_bootloader(BOOTLOADER)
    assert not is_bootloader(b"")
    assert not is_bootloader(BOOTLOADER[1:])
    assert not is_bootloader(b"\x1b\x01 hello")
