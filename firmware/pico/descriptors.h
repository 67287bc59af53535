/* What the board says of itself on the bus. */
#ifndef TOMOSKIN_DESCRIPTORS_H
#define TOMOSKIN_DESCRIPTORS_H

#include <stdint.h>

#define PACKET 64u
#define DATA_INTERFACE 1u
#define EP_NOTIFY 1u /* in; nothing is ever said there */
#define EP_DATA 2u   /* in and out */

struct descriptor {
    const uint8_t *bytes;
    uint8_t size; /* 0: there is none */
};

/* `value` of a GET_DESCRIPTOR: type in the upper byte, index in the lower. */
struct descriptor descriptor_of(uint16_t value);

#endif
