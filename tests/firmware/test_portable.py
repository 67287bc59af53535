"""The portable part under GoogleTest, its coverage and static analysis; and mutants of it.

Each mutant is a mistake that hurts a skin or a measurement; a test that lets one live is no test.
"""

import json
import os
import subprocess

import pytest

from firmware.boards import FIRMWARE, ROOT, make
from firmware.conftest import need

BUILD = ROOT / "build" / "firmware"
LEAST_LINES, LEAST_BRANCHES = 94.0, 80.0

MUTANTS = {
    "swapped demultiplexers": (
        "switches.c",
        "hal_switches_address(source, sink);",
        "hal_switches_address(sink, source);",
    ),
    "swapped on both sides": (
        "scan.c",
        "switches_set(source, sink, dead_time)",
        "switches_set(sink, source, dead_time)",
    ),
    "no dead time": (
        "switches.c",
        "hal_delay_us(dead_time > LEAST_DEAD_TIME_US ? dead_time : LEAST_DEAD_TIME_US);",
        "(void)dead_time;",
    ),
    "the host's dead time forgotten": (
        "switches.c",
        "dead_time > LEAST_DEAD_TIME_US ? dead_time : LEAST_DEAD_TIME_US",
        "LEAST_DEAD_TIME_US + 0u * dead_time",
    ),
    "no break": ("switches.c", "    hal_switches_disable();\n", ""),
    "no latch": ("switches.c", "    hal_switches_latch();\n", ""),
    "source = sink let through": ("switches.c", "source == sink || source", "source"),
    "source = sink accepted": (
        "config.c",
        "if (source == sink)",
        "if (source == sink && source > 9u)",
    ),
    "hang with current on": ("scan.c", "now - scan.since <= scan.allowed", "true"),
    "a halt that leaves the current on": (
        "scan.c",
        "    switches_off();\n    scan.phase",
        "    scan.phase",
    ),
    "a drive that is not ended": (
        "scan.c",
        "    switches_off();\n    if (++scan.direction",
        "    if (++scan.direction",
    ),
    "host silence ignored": ("board.c", "if (board.hello_due ||", "if (true ||"),
    "dirt counts as a host": (
        "commands.c",
        "RESULT_UNKNOWN_COMMAND, 0u);\n        return false;",
        "RESULT_UNKNOWN_COMMAND, 0u);\n        return true;",
    ),
    "stuck sequence number": ("scan.c", "    scan.sequence++;\n", ""),
    "the last incomplete group shifted": (
        "scan.c",
        "(uint8_t)(scan.upper >> (2u * (4u - scan.group)))",
        "scan.upper",
    ),
    "drops not counted": ("scan.c", "        scan.drops++;\n", ""),
    "a frame overwritten while it is sent": ("scan.c", "    filling = after(filling);\n", ""),
    "the first conversion lost": (
        "scan.c",
        "hal_adc_prepare(config.prescaler, config_conversions());",
        "hal_adc_prepare(config.prescaler,"
        " (uint8_t)(config_conversions() - (config_conversions() > 1u)));",
    ),
    "channels in the wrong order": (
        "scan.c",
        "hal_adc_start(scan.channel);",
        "hal_adc_start(scan.channel ^ 1u);",
    ),
    "a command run twice": ("commands.c", "if (!again)", "if (true || !again)"),
    "limiter not looked at": (
        "config.c",
        "current > get_u32",
        "current > 1u + get_u32",
    ),
    "a rate never given up": ("board.c", "board.old_baud = board.baud;", "board.old_baud = 0u;"),
    "checksum not looked at": ("framing.c", " || crc16(in->block, size) != 0u", ""),
    "watchdog kicked by the scan": (
        "scan.c",
        "    switches_off();\n    if (++scan.direction",
        "    hal_watchdog_kick();\n    switches_off();\n    if (++scan.direction",
    ),
    "settling cut short": (
        "scan.c",
        "scan.settling_ticks = config_ticks(config.settling)",
        "scan.settling_ticks = config_ticks(config.settling / 2u)",
    ),
    "a current that never turns": ("scan.c", "(scan.direction & 1u) != 0u", "false"),
    "a difference with the wrong sign": (
        "demodulator.c",
        "DEMODULATED_ZERO + sums[channel].ahead - sums[channel].reversed",
        "DEMODULATED_ZERO + sums[channel].reversed - sums[channel].ahead",
    ),
    "sums of the drive before": ("scan.c", "    }\n    demodulator_clear();\n", "    }\n"),
    "one direction longer than the other": (
        "scan.c",
        "hal_timer_extend(scan.on_ticks);",
        "hal_timer_extend((uint16_t)(scan.on_ticks - (reversed() ? 3u : 0u)));",
    ),
    "directions that are not held": (
        "scan.c",
        "    scan.phase = HOLDING;\n    hal_timer_extend(scan.on_ticks);",
        "    end_direction();",
    ),
    "a current that turns without a break": (
        "scan.c",
        "    switches_off();\n    if (++scan.direction",
        "    if (scan.direction % 2u != 0u) {\n        switches_off();\n    }\n"
        "    if (++scan.direction",
    ),
    "no guard while a direction is held": (
        "scan.c",
        "return scan.on_ticks + SLACK_TICKS;",
        "return 100u * SLACK_TICKS;",
    ),
    "a frequency that is let through": (
        "config.c",
        "chopped && config.frequency > chop_limit(most)",
        "chopped && config.frequency > 2u * chop_limit(most)",
    ),
    "late samples that are not said": (
        "scan.c",
        "        scan.noticed = (uint8_t)(scan.noticed | FLAG_LATE);\n",
        "",
    ),
    "lost bytes that are not said": (
        "scan.c",
        "        scan.noticed = (uint8_t)(scan.noticed | FLAG_DEAF);\n",
        "",
    ),
    "a loss forgotten with a dropped frame": (
        "scan.c",
        "    if (!scan.broken) {\n        scan.noticed = 0u;",
        "    if (true) {\n        scan.noticed = 0u;",
    ),
    "a driven reference let through": (
        "config.c",
        "if (drives_reference(drive->source, drive->sink, electrodes) ||",
        "if ((drive->source > 9u && drives_reference(drive->source, drive->sink, electrodes)) ||",
    ),
    "a reference driven in the other direction": (
        "config.c",
        "(chopped && drives_reference(drive->sink, drive->source, electrodes))",
        "(chopped && drive->sink > 9u && drives_reference(drive->sink, drive->source, electrodes))",
    ),
    "a mode that outlives its scan": ("config.c", "    config.mode = DRIVE_MODE_DIRECT;\n", ""),
}


@pytest.fixture(scope="session")
def googletest():
    need(["make", "cc", "c++", "gcovr"], "make g++ libgtest-dev gcovr")
    made = make("coverage")
    assert made.returncode == 0, made.stdout + made.stderr
    return json.loads((BUILD / "coverage.json").read_text(encoding="utf-8"))


def test_the_portable_part_passes_and_is_covered(googletest):
    assert googletest["line_percent"] >= LEAST_LINES
    assert googletest["branch_percent"] >= LEAST_BRANCHES


@pytest.mark.parametrize("name", MUTANTS)
def test_a_mutant_has_its_place(name):
    file, old, _ = MUTANTS[name]
    assert (FIRMWARE / "src" / file).read_text(encoding="utf-8").count(old) == 1


@pytest.mark.slow
@pytest.mark.parametrize("name", MUTANTS)
def test_a_mutant_is_caught(name, googletest, tmp_path):
    assert googletest
    file, old, new = MUTANTS[name]
    text = (FIRMWARE / "src" / file).read_text(encoding="utf-8")
    mutant, program = tmp_path / file, tmp_path / "mutant"
    mutant.write_text(text.replace(old, new), encoding="utf-8")
    with_object = f"OBJECT={file[:-2]}.o"
    built = make("mutant", f"MUTANT={mutant}", f"PROGRAM={program}", with_object)
    assert built.returncode == 0, built.stderr
    tests = "Framing.*" if file == "framing.c" else "Board.*:Chopped.*"
    ran = subprocess.run(
        [program, "--gtest_brief=1", f"--gtest_filter={tests}"],
        capture_output=True,
        check=False,
        timeout=60,
        env={**os.environ, "GCOV_PREFIX": str(tmp_path)},
    )
    assert ran.returncode != 0, f"nothing noticed: {name}"


def test_static_analysis_finds_nothing():
    need(["make", "cppcheck"], "make cppcheck")
    checked = make("cppcheck")
    assert checked.returncode == 0, checked.stderr
