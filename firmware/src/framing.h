/* COBS(payload, CRC-16/CCITT-FALSE big-endian), 0x00: both directions. */
#ifndef TOMOSKIN_FRAMING_H
#define TOMOSKIN_FRAMING_H

#include "protocol.h"

#include <stdbool.h>
#include <stdint.h>

/* Bytes that a buffer needs behind its payload: the checksum. */
#define FRAMING_AFTER 2u

static inline uint16_t crc16_step(uint16_t crc, uint8_t byte) {
    uint8_t x = (uint8_t)((uint8_t)(crc >> 8) ^ byte);
    x ^= (uint8_t)(x >> 4);
    return (uint16_t)((uint16_t)(crc << 8) ^ (uint16_t)((uint16_t)x << 12) ^
                      (uint16_t)((uint16_t)x << 5) ^ x);
}

uint16_t crc16(const uint8_t *data, uint16_t size);

/* Sends one buffer, byte by byte. */
struct outgoing {
    const uint8_t *at;  /* next byte */
    const uint8_t *end; /* behind the checksum */
    uint8_t run;        /* bytes to go before the next code byte */
    bool full;          /* the run is as long as a code byte can say: no zero follows it */
    bool active;
};

void outgoing_begin(struct outgoing *out, uint8_t *buffer, uint16_t payload_size);

/* The next byte of the line; after the 0x00 `active` is false. */
uint8_t outgoing_next(struct outgoing *out);

/* Gathers the bytes from the host. */
struct incoming {
    uint8_t block[MOST_TO_DEVICE + 1u];
    uint8_t size;
    bool overlong;
};

/* Take a byte; the size of a whole payload, then in `block`, or 0. */
uint8_t incoming_take(struct incoming *in, uint8_t byte);

#endif
