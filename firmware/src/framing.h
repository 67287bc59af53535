/* COBS(payload, CRC-16/CCITT-FALSE big-endian), 0x00: both directions. */
#ifndef TOMOSKIN_FRAMING_H
#define TOMOSKIN_FRAMING_H

#include "protocol.h"

#include <stdbool.h>
#include <stdint.h>

/* A message is enclosed where it lies: its payload begins at FRAMING_BEFORE, and its buffer has
   FRAMING_AFTER(its most bytes) behind it: checksum, 0x00, and a code byte for every 254 bytes. */
#define FRAMING_BEFORE 1u
#define FRAMING_AFTER(size) (CHECKSUM_SIZE + 1u + ((size) + CHECKSUM_SIZE) / 254u + 1u)

#define MOST_BLOCK (MOST_TO_DEVICE + 1u) /* from the host, between two 0x00 */
#define CHECKSUM_SIZE 2u

uint16_t crc16(const uint8_t *data, uint16_t size);

/* Enclose a payload of `size` bytes; how many bytes of `buffer` go on the line. */
uint16_t framing_enclose(uint8_t *buffer, uint16_t size);

/* Gathers the bytes from the host. */
struct incoming {
    uint8_t block[MOST_BLOCK];
    uint8_t size;
    bool overlong;
};

/* Take a byte; the size of a whole payload, then in `block`, or 0. */
uint8_t incoming_take(struct incoming *in, uint8_t byte);

#endif
