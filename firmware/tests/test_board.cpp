// The portable firmware on a watched machine: safety, scan, protocol.
#include "fixture.h"

#include <algorithm>
#include <gtest/gtest.h>

namespace {

TEST_F(Board, IsSafeFromResetOn) {
    ASSERT_FALSE(machine.events.empty());
    EXPECT_EQ(machine.events[0].move, Machine::Move::kDisable);
    machine.run_us(3'000'000);
    expect_off();
}

TEST_F(Board, SaysHelloEveryHalfSecondUntilSpokenTo) {
    machine.run_us(1'900'000);
    auto hellos = of(MSG_HELLO, machine.heard());
    ASSERT_EQ(hellos.size(), 4u);
    EXPECT_EQ(u32_at(hellos[0], AT_HELLO_SCHEMA_HASH), PROTOCOL_HASH);
    EXPECT_EQ(ask({MSG_PING}), RESULT_OK);
    machine.run_us(1'500'000);
    EXPECT_TRUE(machine.heard().empty());
}

TEST_F(Board, FramesHoldWhatTheDrivesRead) {
    scan();
    machine.run_us(200'000);
    auto frames = of(MSG_FRAME, machine.heard());
    EXPECT_GT(frames.size(), 10u);
    expect_frames(frames);
}

TEST_F(Board, FramesSayWhatWasLostMeanwhile) {
    scan();
    machine.run_us(100'000);
    machine.lost.conversions++;
    machine.run_us(50'000);
    machine.lost.bytes += 3;
    machine.run_us(50'000);
    unsigned late = 0, deaf = 0;
    auto frames = of(MSG_FRAME, machine.heard());
    for (const Bytes &frame : frames) {
        late += (frame[AT_FRAME_FLAGS] & FLAG_LATE) != 0;
        deaf += (frame[AT_FRAME_FLAGS] & FLAG_DEAF) != 0;
    }
    EXPECT_GT(frames.size(), 10u);
    EXPECT_EQ(late, 1u);
    EXPECT_EQ(deaf, 1u);
    EXPECT_EQ(frames.back()[AT_FRAME_FLAGS], 0u);
}

TEST_F(Board, ALossIsSaidByTheFrameItHappenedIn) {
    scan();
    machine.run_us(100'000);
    size_t before = of(MSG_FRAME, machine.heard()).size();
    machine.lost.conversions++;  // while the next one is scanned
    machine.run_us(100'000);
    auto frames = of(MSG_FRAME, machine.heard());
    ASSERT_GT(before, 1u);
    ASSERT_GT(frames.size(), 2u);
    EXPECT_EQ(frames[0][AT_FRAME_FLAGS], FLAG_LATE);
    EXPECT_EQ(frames[1][AT_FRAME_FLAGS], 0u);
}

TEST_F(Board, WhatADroppedFrameWouldHaveSaidTheNextOneSays) {
    scan();
    machine.run_us(100'000);
    machine.room = 0;  // the line stands still: frames are dropped
    machine.run_us(100'000);
    machine.lost.conversions++;
    machine.run_us(100'000);
    machine.room = 2000;
    (void)machine.heard();
    machine.run_us(100'000);
    bool said = false;
    for (const Bytes &frame : of(MSG_FRAME, machine.heard())) {
        said = said || (frame[AT_FRAME_FLAGS] & FLAG_LATE) != 0;
    }
    EXPECT_TRUE(said);
}

TEST_F(Board, SaysItsLossesWhenAsked) {
    machine.lost = {0x1234, 0x5678};
    machine.say({MSG_GET_LOSSES, 9});
    machine.run_us(200);
    auto said = of(MSG_LOSSES, machine.heard());
    ASSERT_EQ(said.size(), 1u);
    ASSERT_EQ(said[0].size(), SIZE_LOSSES);
    EXPECT_EQ(said[0][AT_LOSSES_REQUEST], 9u);
    EXPECT_EQ(u16_at(said[0], AT_LOSSES_CONVERSIONS), 0x1234u);
    EXPECT_EQ(u16_at(said[0], AT_LOSSES_BYTES), 0x5678u);
}

TEST_F(Board, WhatWasLostBeforeStartIsNoFlag) {
    machine.lost = {7, 9};
    scan();
    machine.run_us(50'000);
    auto frames = of(MSG_FRAME, machine.heard());
    EXPECT_GT(frames.size(), 2u);
    expect_frames(frames);
}

TEST_F(Board, ADriveWhoseReferenceWouldBeTheSourceIsRefused) {
    drives = {{1, 0, 0x00FC}, {3, 4, 0x00C3}, {7, 0, 0x003C}};
    set_up();
    EXPECT_EQ(start(), RESULT_OK);  // against the sink's line any pair can be read
    EXPECT_EQ(ask({MSG_STOP}), RESULT_OK);
    machine.against_neighbour = true;
    EXPECT_EQ(start(), RESULT_DRIVEN_REFERENCE);
    EXPECT_EQ(detail, 1u);
    drives[1] = {2, 4, 0x00C3};
    set_up();
    EXPECT_EQ(start(), RESULT_DRIVEN_REFERENCE);  // of 8 electrodes the last one is before the first
    EXPECT_EQ(detail, 2u);
    drives[2] = {6, 0, 0x003C};
    drives[0].mask |= 0x0080;
    set_up();
    EXPECT_EQ(start(), RESULT_OK);
}

TEST_F(Board, AnyTableOfDrives) {
    drives = {{3, 0, 0x0001}, {15, 7, 0xFFFF}, {0, 15, 0x8000}, {1, 2, 0}};
    oversampling = 64;
    settling = 0;
    scan();
    machine.run_us(500'000);
    auto frames = of(MSG_FRAME, machine.heard());
    EXPECT_GT(frames.size(), 3u);
    expect_frames(frames);
}

TEST_F(Board, PackedFramesHoldTheSameInTenBits) {
    oversampling = 1;
    drives = {{3, 0, 0x00FE}, {7, 1, 0xFFFF}, {0, 15, 0x8003}};  // 26 samples: the last two alone
    set_up();
    ASSERT_EQ(set_format(FORMAT_PACKED), RESULT_OK);
    ASSERT_EQ(start(), RESULT_OK);
    machine.run_us(50'000);
    auto frames = of(MSG_FRAME_PACKED, machine.heard());
    ASSERT_GT(frames.size(), 3u);
    auto wanted = expected();
    for (const Bytes &frame : frames) {
        Bytes packed(frame.begin() + SIZE_FRAME_PACKED, frame.end());
        ASSERT_EQ(packed.size(), wanted.size() + (wanted.size() + 3) / 4);
        for (size_t s = 0; s < wanted.size(); s++) {
            size_t group = s / 4 * 5;
            size_t upper = std::min(group + 4, packed.size() - 1);
            unsigned sample = packed[group + s % 4] | (packed[upper] >> 2 * (s % 4) & 3u) << 8;
            ASSERT_EQ(sample, wanted[s]) << "sample " << s;
        }
    }
}

TEST_F(Board, TheLastIncompleteGroupHasItsUpperBitsWhereWholeOnesDo) {
    oversampling = 1;
    for (size_t left : {1u, 2u, 3u}) {
        SCOPED_TRACE(left);
        machine.power_on();
        drives = {{12, 5, static_cast<uint16_t>(0x0Fu | (0x700u >> (3u - left) & 0x700u))}};
        auto wanted = expected();
        ASSERT_EQ(wanted.size(), 4u + left);
        set_up();
        ASSERT_EQ(set_format(FORMAT_PACKED), RESULT_OK);
        ASSERT_EQ(start(), RESULT_OK);
        machine.run_us(5'000);
        auto frames = of(MSG_FRAME_PACKED, machine.heard());
        ASSERT_GT(frames.size(), 0u);
        unsigned upper = 0;
        for (size_t s = 0; s < left; s++) {
            upper |= wanted[4 + s] >> 8 << 2 * s;
        }
        EXPECT_NE(upper, 0u) << "a shift of nothing is no test";
        EXPECT_EQ(frames[0].back(), upper);
    }
}

TEST_F(Board, OnlySingleConversionsArePacked) {
    EXPECT_EQ(set_format(FORMAT_PACKED), RESULT_WRONG_CONFIGURATION);
    oversampling = 2;
    ASSERT_EQ(set_scan(1), RESULT_OK);
    EXPECT_EQ(set_format(FORMAT_PACKED), RESULT_BAD_VALUE);
    EXPECT_EQ(set_format(FORMAT_SIXTEEN), RESULT_OK);
    oversampling = 1;
    ASSERT_EQ(set_scan(1), RESULT_OK);
    EXPECT_EQ(set_format(4), RESULT_BAD_VALUE);
    EXPECT_EQ(set_format(FORMAT_PACKED), RESULT_OK);
    ASSERT_EQ(set_scan(1), RESULT_OK);  // back to what every host understands
    ASSERT_EQ(set_drive(0, {1, 0, 4}), RESULT_OK);
    ASSERT_EQ(start(), RESULT_OK);
    machine.run_us(5'000);
    EXPECT_GT(of(MSG_FRAME, machine.heard()).size(), 0u);
}

TEST_F(Board, TellsWhatItHolds) {
    settling = 70'000;
    dead = 300;
    drives.assign(11, {3, 1, 0x8F01});
    EXPECT_EQ(ask({MSG_GET_SCAN}), RESULT_WRONG_CONFIGURATION);
    EXPECT_EQ(ask({MSG_GET_PATTERN, 0, 0}), RESULT_WRONG_CONFIGURATION);
    set_up();
    auto tell = [](Bytes payload) {
        machine.heard();
        machine.say(payload);
        machine.run_us(300);
        return machine.heard();
    };
    EXPECT_EQ(tell({MSG_GET_SCAN, 77}),
              std::vector<Bytes>({{MSG_SCAN, 77, 5, 0, 11, 0, 0x70, 0x11, 1, 0, 44, 1, 4, 64, 0xA0,
                                   0x86, 1, 0, FORMAT_SIXTEEN}}));
    Bytes last{MSG_PATTERN, 78, 5, 0, 9, 0, 3, 1, 1, 0x8F, 0, 0, 3, 1, 1, 0x8F, 0, 0};
    EXPECT_EQ(tell({MSG_GET_PATTERN, 78, 9, 0}), std::vector<Bytes>({last}));
    auto first = tell({MSG_GET_PATTERN, 79, 0, 0});
    ASSERT_EQ(first.size(), 1u);
    EXPECT_EQ(first[0].size(), SIZE_PATTERN + 9 * SIZE_DRIVE);
    EXPECT_EQ(ask({MSG_GET_PATTERN, 11, 0}), RESULT_BAD_VALUE);
    ASSERT_EQ(set_scan(1), RESULT_OK);
    Bytes unset{MSG_PATTERN, 80, 5, 0, 0, 0, 255, 255, 0, 0, 0, 0};
    EXPECT_EQ(tell({MSG_GET_PATTERN, 80, 0, 0}), std::vector<Bytes>({unset}));
}

TEST_F(Board, ASettlingTimeIsKept) {
    settling = 20'000;
    drives = {{1, 0, 4}, {2, 0, 2}};
    scan();
    machine.run_us(100'000);
    auto frames = of(MSG_FRAME, machine.heard());
    ASSERT_GE(frames.size(), 2u);
    uint32_t period = u32_at(frames[1], AT_FRAME_TICKS) - u32_at(frames[0], AT_FRAME_TICKS);
    double wanted_us = 2 * (20'000 + 4 * 52 + 5);
    EXPECT_NEAR(period * 4.0, wanted_us, 40);
    EXPECT_GE(machine.longest_on_ns, 20'000'000u);
}

TEST_F(Board, DeadTimesOfAllLengths) {
    for (unsigned us : {0u, 1u, 50u, 51u, 3000u}) {
        SCOPED_TRACE(us);
        machine.power_on();
        dead = us;
        scan();
        machine.run_us(100'000);
        EXPECT_GE(of(MSG_FRAME, machine.heard()).size(), 2u);
        EXPECT_EQ(machine.wrongs, std::vector<std::string>{});
    }
}

TEST_F(Board, StopSwitchesOffAtOnce) {
    scan();
    machine.run_us(7'777);
    EXPECT_EQ(ask({MSG_STOP}), RESULT_OK);
    expect_off();
    machine.heard();
    EXPECT_EQ(start(), RESULT_OK);
    machine.run_us(50'000);
    expect_frames(of(MSG_FRAME, machine.heard()));
}

TEST_F(Board, SafeOffForgets) {
    scan();
    EXPECT_EQ(ask({MSG_SAFE_OFF}), RESULT_OK);
    expect_off();
    EXPECT_EQ(start(), RESULT_WRONG_CONFIGURATION);
}

TEST_F(Board, HostSilenceSwitchesOff) {
    scan();
    machine.run_us(1'990'000, 1000);
    EXPECT_NE(of(MSG_FRAME, machine.heard()).size(), 0u);
    machine.run_us(20'000, 1000);
    auto all = machine.heard();
    EXPECT_EQ(of(MSG_FAULT, all).size(), 1u);
    EXPECT_EQ(of(MSG_FAULT, all)[0][AT_FAULT_CODE], FAULT_HOST_SILENT);
    EXPECT_EQ(of(MSG_HELLO, all).size(), 1u);
    expect_off();
}

TEST_F(Board, PingKeepsItAlive) {
    scan();
    for (int k = 0; k < 8; k++) {
        machine.run_us(500'000, 1000);
        machine.heard();
        ASSERT_EQ(ask({MSG_PING}), RESULT_OK);
    }
    EXPECT_EQ(of(MSG_FAULT, machine.heard()).size(), 0u);
}

TEST_F(Board, APulledPlugSwitchesOffAtOnce) {
    scan();
    machine.run_us(10'000);
    machine.heard();
    machine.plugged_in = false;
    machine.run_us(200);
    EXPECT_EQ(machine.source, -1);
    expect_off();
    machine.plugged_in = true;
    machine.run_us(1'000);
    expect_fault(FAULT_HOST_SILENT, 0);
}

TEST_F(Board, DirtDoesNotKeepItAlive) {
    scan();
    for (int k = 0; k < 25; k++) {
        machine.run_us(100'000, 1000);
        machine.say_raw({1, 2, 3, 0});
        machine.say({0x55, 1});
    }
    expect_off();
}

TEST_F(Board, AConverterThatHangsIsAFault) {
    scan();
    machine.run_us(1'000);
    machine.heard();
    machine.converter_works = false;
    machine.run_us(30'000);
    EXPECT_EQ(machine.source, -1);
    auto faults = of(MSG_FAULT, machine.heard());
    ASSERT_EQ(faults.size(), 1u);
    EXPECT_EQ(faults[0][AT_FAULT_CODE], FAULT_CONVERTER);
    expect_off();
}

TEST_F(Board, ATimerThatHangsDoesNotLeaveTheCurrentOn) {
    machine.timer_works = false;
    scan();
    machine.run_us(5'000);
    expect_fault(FAULT_CURRENT_TOO_LONG, 0);
    expect_off();
    EXPECT_LT(machine.longest_on_ns, 10'000'000u);
}

TEST_F(Board, OnlyTheMainLoopKicksTheWatchdog) {
    scan();
    uint64_t before = machine.kicked_ns;
    machine.hang_us(300'000);
    EXPECT_EQ(machine.kicked_ns, before);
    machine.run_us(100);
    EXPECT_GT(machine.kicked_ns, before);
}

TEST_F(Board, CausesOfAResetAreToldAsFaults) {
    machine.reset_cause = RESET_WATCHDOG;
    machine.power_on();
    machine.run_us(1000);
    expect_fault(FAULT_WATCHDOG, 0);
    machine.reset_cause = RESET_BROWN_OUT;
    machine.power_on();
    machine.run_us(1000);
    expect_fault(FAULT_BROWN_OUT, 0);
}

TEST_F(Board, SourceAndSinkAreNeverTheSame) {
    ASSERT_EQ(set_scan(2), RESULT_OK);
    EXPECT_EQ(set_drive(1, {3, 3, 1}), RESULT_SAME_ELECTRODE);
    EXPECT_EQ(detail, 1u);
    EXPECT_FALSE(switches_set(3, 3, 0));
    EXPECT_FALSE(switches_set(16, 3, 0));
    EXPECT_FALSE(switches_set(3, 16, 0));
    EXPECT_FALSE(switches_set(SWITCHES_OFF, 3, 0));
    EXPECT_EQ(machine.source, -1);
}

TEST_F(Board, RefusesWhatItCannotDo) {
    EXPECT_EQ(set_scan(129), RESULT_TOO_MANY_DRIVES);
    EXPECT_EQ(set_scan(0), RESULT_BAD_VALUE);
    ASSERT_EQ(set_scan(3), RESULT_OK);
    EXPECT_EQ(set_drive(0, {16, 3, 1}), RESULT_NO_SUCH_CHANNEL);
    EXPECT_EQ(set_drive(3, {1, 0, 1}), RESULT_BAD_VALUE);
    EXPECT_EQ(set_drive(1, {1, 0, 1}), RESULT_OK);
    EXPECT_EQ(start(), RESULT_INCOMPLETE);
    EXPECT_EQ(detail, 0u);
    EXPECT_EQ(ask({MSG_SET_BAUD, 1, 0, 0, 0}), RESULT_BAD_VALUE);
    EXPECT_EQ(ask({MSG_SET_HEARTBEAT, 99, 0}), RESULT_BAD_VALUE);
    EXPECT_EQ(ask({MSG_START, 5}), RESULT_BAD_LENGTH);
    EXPECT_EQ(ask({0x55, 5}), RESULT_UNKNOWN_COMMAND);
    machine.current = 100'001;
    EXPECT_EQ(set_scan(3), RESULT_CURRENT_TOO_HIGH);
    machine.current = CURRENT_DAMAGED;
    EXPECT_EQ(set_scan(3, UINT32_MAX), RESULT_CURRENT_TOO_HIGH);
}

TEST_F(Board, TooManySamplesAreRefused) {
    drives.assign(29, {1, 0, 0xFFFF});
    set_up();
    EXPECT_EQ(start(), RESULT_TOO_MANY_SAMPLES);
    EXPECT_EQ(detail, MOST_SAMPLES);
}

TEST_F(Board, BusyWhileScanning) {
    scan();
    EXPECT_EQ(set_scan(1), RESULT_BUSY);
    EXPECT_EQ(start(), RESULT_BUSY);
    EXPECT_EQ(ask({MSG_SET_BAUD, 0x20, 0xA1, 7, 0}), RESULT_BUSY);
}

TEST_F(Board, ARepeatedCommandIsAnsweredNotRun) {
    scan();
    machine.run_us(20'000);
    machine.heard();
    machine.say({MSG_START, request, 5, 0});
    machine.run_us(200);
    auto acks = of(MSG_ACK, machine.heard());
    ASSERT_EQ(acks.size(), 1u);
    EXPECT_EQ(acks[0][AT_ACK_RESULT], RESULT_OK);
}

TEST_F(Board, ASlowLineDropsWholeFramesAndCountsThem) {
    scan();
    for (int k = 0; k < 10; k++) {
        machine.room = 0;  // the line stands still for eight frames or so
        machine.run_us(100'000);
        machine.room = 2000;
        machine.run_us(30'000);
    }
    auto frames = of(MSG_FRAME, machine.heard());
    ASSERT_GT(frames.size(), 3u);
    uint32_t expected_sequence = 0;
    unsigned drops = 0;
    for (const Bytes &frame : frames) {
        uint32_t sequence = u32_at(frame, AT_FRAME_SEQUENCE);
        EXPECT_GE(sequence, expected_sequence);
        EXPECT_EQ((frame[AT_FRAME_FLAGS] & FLAG_DROPPED) != 0, sequence != expected_sequence);
        drops += sequence - expected_sequence;
        EXPECT_EQ(u16_at(frame, AT_FRAME_DROPS), drops);
        expected_sequence = sequence + 1;
    }
    EXPECT_GT(drops, 10u);
}

TEST_F(Board, AFrameBeingSentOutlivesStopAndStart) {
    scan();
    machine.room = 1;
    machine.run_us(9'000, 500);
    machine.heard();
    machine.room = 2000;
    EXPECT_EQ(ask({MSG_STOP}), RESULT_OK);
    EXPECT_EQ(start(), RESULT_OK);
    machine.run_us(30'000);
    expect_frames(of(MSG_FRAME, machine.heard()));
}

TEST_F(Board, LongRunsWithoutZeroAreEnclosed) {
    drives.assign(25, {15, 14, 0xFFFF});
    oversampling = 63;
    scan();
    machine.run_us(6'000'000, 1000);
    auto frames = of(MSG_FRAME, machine.heard());
    ASSERT_GE(frames.size(), 1u);
    expect_frames({frames[0]});
}

TEST_F(Board, ARateThatNobodyConfirmsIsGivenUp) {
    ASSERT_EQ(ask({MSG_SET_BAUD, 0x20, 0xA1, 7, 0}), RESULT_OK);
    EXPECT_EQ(machine.baud, 500'000u);
    machine.run_us(990'000, 1000);
    EXPECT_EQ(machine.baud, 500'000u);
    machine.run_us(20'000, 1000);
    EXPECT_EQ(machine.baud, FIRST_BAUD);
    ASSERT_EQ(ask({MSG_SET_BAUD, 0x20, 0xA1, 7, 0}), RESULT_OK);
    ASSERT_EQ(ask({MSG_PING}), RESULT_OK);
    machine.run_us(1'500'000, 1000);
    EXPECT_EQ(machine.baud, 500'000u);
}

TEST_F(Board, TheClockGoesOnBeyondThirtyTwoBits) {
    machine.ns = (uint64_t{1} << 32) * 4000 - 5'000'000;
    machine.run_us(1000);
    scan();
    machine.run_us(60'000);
    auto frames = of(MSG_FRAME, machine.heard());
    ASSERT_GT(frames.size(), 3u);
    uint64_t before = 0;
    for (const Bytes &frame : frames) {
        uint64_t ticks = u32_at(frame, AT_FRAME_TICKS) |
                         static_cast<uint64_t>(u32_at(frame, AT_FRAME_TICKS + 4)) << 32;
        EXPECT_GT(ticks, before);
        EXPECT_LT(ticks - (before != 0 ? before : ticks - 1), 100'000u);
        before = ticks;
    }
    EXPECT_EQ(before >> 32, 1u);
}

}  // namespace
