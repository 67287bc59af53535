#include "framing.h"

#define FULL 254u /* longest run behind one code byte */

uint16_t crc16(const uint8_t *data, uint16_t size) {
    uint16_t crc = 0xFFFFu;
    while (size-- != 0u) {
        crc = crc16_step(crc, *data++);
    }
    return crc;
}

void outgoing_begin(struct outgoing *out, uint8_t *buffer, uint16_t payload_size) {
    uint8_t *end = buffer + payload_size;
    uint16_t crc = crc16(buffer, payload_size);
    *end++ = (uint8_t)(crc >> 8);
    *end++ = (uint8_t)crc;
    out->at = buffer;
    out->end = end;
    out->run = 0u;
    out->full = true; /* the first code byte stands for no zero either */
    out->active = true;
}

static uint8_t run_length(const uint8_t *at, const uint8_t *end) {
    uint8_t length = 0u;
    while (at != end && *at != 0u && length < FULL) {
        at++;
        length++;
    }
    return length;
}

uint8_t outgoing_next(struct outgoing *out) {
    if (out->run != 0u) {
        out->run--;
        return *out->at++;
    }
    if (out->at == out->end) {
        out->active = false;
        return 0u;
    }
    if (!out->full) {
        out->at++; /* the zero that the last code byte stood for */
    }
    out->run = run_length(out->at, out->end);
    out->full = out->run == FULL;
    return (uint8_t)(out->run + 1u);
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
    if (size <= FRAMING_AFTER || crc16(in->block, size) != 0u) {
        return 0u;
    }
    return (uint8_t)(size - FRAMING_AFTER);
}
