#include "framing.h"

#include "hal.h"

#include <string.h>

#define FULL 254u /* longest run behind one code byte */

uint16_t crc16(const uint8_t *data, uint16_t size) {
    uint16_t crc = 0xFFFFu;
    while (size-- != 0u) {
        crc = hal_crc16(crc, *data++);
    }
    return crc;
}

/* A run is longer than its code byte can say: cut it with a code byte more. Where that stands. */
static uint8_t *cut(uint8_t *code, const uint8_t *end) {
    uint8_t *next = code + FULL + 1u;
    *code = FULL + 1u;
    (void)memmove(next + 1, next, (size_t)(end - next));
    return next;
}

struct runs {
    uint8_t *code; /* the code byte of the run that is open */
    uint8_t *end;  /* of the message; it moves when a run is cut */
};

/* A zero at `at` ends the run and becomes the next one's code byte. Where the zero is now. */
static uint8_t *end_run(struct runs *runs, uint8_t *at) {
    for (; at - runs->code > (int16_t)FULL; at++, runs->end++) {
        runs->code = cut(runs->code, runs->end);
    }
    *runs->code = (uint8_t)(at - runs->code);
    runs->code = at;
    return at;
}

/* Checksum and zeros in one pass over the payload. */
uint16_t framing_enclose(uint8_t *buffer, uint16_t size) {
    uint8_t *at = buffer + FRAMING_BEFORE;
    struct runs runs = {buffer, at + size};
    uint16_t crc = 0xFFFFu;
    while (size != 0u) {
        uint8_t some = size < 255u ? (uint8_t)size : 255u;
        size = (uint16_t)(size - some);
        do { /* a counter of eight bits: 20 cycles a byte on an AVR */
            uint8_t byte = *at++;
            crc = hal_crc16(crc, byte);
            if (byte == 0u) {
                at = end_run(&runs, at - 1) + 1;
            }
        } while (--some != 0u);
    }
    *runs.end++ = (uint8_t)(crc >> 8);
    *runs.end++ = (uint8_t)crc;
    for (; at != runs.end; at++) {
        if (*at == 0u) {
            at = end_run(&runs, at);
        }
    }
    for (; runs.end - runs.code > (int16_t)FULL + 1; runs.end++) {
        runs.code = cut(runs.code, runs.end);
    }
    *runs.code = (uint8_t)(runs.end - runs.code);
    *runs.end++ = 0u;
    return (uint16_t)(runs.end - buffer);
}

/* In place: code bytes give way to the zeros that they stand for. The size, or 0 when torn. */
static uint8_t cobs_decode(uint8_t *block, uint8_t size) {
    uint8_t from = 0u;
    uint8_t to = 0u;
    while (from < size) {
        uint8_t code = block[from++];
        uint8_t left = (uint8_t)(code - 1u);
        if (left > (uint8_t)(size - from)) {
            return 0u;
        }
        for (; left != 0u; left--) {
            block[to++] = block[from++];
        }
        if (from < size) {
            block[to++] = 0u; /* a block is too short for a full run */
        }
    }
    return to;
}

uint8_t incoming_take(struct incoming *in, uint8_t byte) {
    if (byte != 0u) {
        if (in->size == sizeof in->block) {
            in->overlong = true;
        } else {
            in->block[in->size++] = byte;
        }
        return 0u;
    }
    bool overlong = in->overlong;
    uint8_t size = in->size;
    in->overlong = false;
    in->size = 0u;
    if (overlong) {
        return 0u;
    }
    size = cobs_decode(in->block, size);
    if (size <= CHECKSUM_SIZE || crc16(in->block, size) != 0u) {
        return 0u;
    }
    return (uint8_t)(size - CHECKSUM_SIZE);
}
