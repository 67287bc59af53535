// Framing against a second, slower reading of docs/protocol.md.
#include "machine.h"

#include <gtest/gtest.h>
#include <random>

extern "C" {
#include "framing.h"
}

namespace {

Bytes framed(Bytes payload) {
    auto size = static_cast<uint16_t>(payload.size());
    payload.insert(payload.begin(), FRAMING_BEFORE, 0);
    payload.resize(payload.size() + FRAMING_AFTER(size));  // the sanitizer watches its ends
    payload.resize(framing_enclose(payload.data(), size));
    return payload;
}

Bytes random_bytes(std::mt19937 &random, size_t size, int values) {
    Bytes bytes(size);
    for (uint8_t &byte : bytes) {
        byte = static_cast<uint8_t>(random() % static_cast<unsigned>(values));
    }
    return bytes;
}

TEST(Framing, ChecksumOfTheCheckString) {
    const Bytes check{'1', '2', '3', '4', '5', '6', '7', '8', '9'};
    EXPECT_EQ(crc16(check.data(), 9), 0x29B1);
}

TEST(Framing, OutgoingIsWhatTheDocumentSays) {
    std::mt19937 random(7);
    for (size_t size = 1; size <= 1000; size++) {
        for (int values : {1, 2, 256}) {
            Bytes payload = random_bytes(random, size, values);
            ASSERT_EQ(framed(payload), enclose(payload)) << size << " of " << values;
        }
        ASSERT_EQ(framed(Bytes(size, 9)), enclose(Bytes(size, 9))) << size;
    }
    for (size_t size = MOST_FROM_DEVICE - 260u; size <= MOST_FROM_DEVICE - CHECKSUM_SIZE; size++) {
        ASSERT_EQ(framed(Bytes(size, 9)), enclose(Bytes(size, 9))) << size;
    }
}

TEST(Framing, IncomingFindsWhatWasSentBehindAnyDirt) {
    std::mt19937 random(8);
    struct incoming in = {};
    for (int k = 0; k < 20000; k++) {
        Bytes dirt = random_bytes(random, random() % 150, k % 2 ? 256 : 8);
        dirt.push_back(0);
        for (uint8_t byte : dirt) {
            incoming_take(&in, byte);
        }
        Bytes payload = random_bytes(random, 1 + random() % 60, k % 3 ? 256 : 2);
        unsigned got = 0;
        for (uint8_t byte : enclose(payload)) {
            got = incoming_take(&in, byte);
        }
        ASSERT_EQ(got, payload.size());
        ASSERT_EQ(Bytes(in.block, in.block + got), payload);
    }
}

TEST(Framing, OneFlippedBitIsNeverAccepted) {
    Bytes payload{MSG_START, 1, 5, 0};
    Bytes line = enclose(payload);
    for (size_t bit = 0; bit < 8 * (line.size() - 1); bit++) {
        Bytes bent = line;
        bent[bit / 8] = static_cast<uint8_t>(bent[bit / 8] ^ 1u << bit % 8);
        struct incoming in = {};
        for (uint8_t byte : bent) {
            ASSERT_EQ(incoming_take(&in, byte), 0u) << "bit " << bit;
        }
    }
}

TEST(Framing, TooLongIsDropped) {
    struct incoming in = {};
    for (uint8_t byte : enclose(Bytes(61, 1))) {
        ASSERT_EQ(incoming_take(&in, byte), 0u);
    }
}

}  // namespace
