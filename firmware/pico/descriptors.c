#include "descriptors.h"

#include "flash.h"

#include <stddef.h>

#define DEVICE 1u
#define CONFIGURATION 2u
#define STRING 3u
#define MOST_STRING 32u

/* Raspberry Pi's numbers for a Pico that is a serial port. */
static const uint8_t device[] = {
    18, DEVICE, 0x00, 0x02, 0xEF, 2, 1, PACKET, /* USB 2.0, functions by association */
    0x8A, 0x2E, 0x0A, 0x00, 0x01, 0x01,         /* vendor, product, release */
    1, 2, 3, 1,                                 /* strings; one configuration */
};

static const uint8_t configuration[] = {
    9, CONFIGURATION, 75, 0, 2, 1, 0, 0x80, 250,     /* 500 mA from the bus */
    8, 11, 0, 2, 2, 2, 0, 0,                         /* interfaces 0 and 1 belong together */
    9, 4, 0, 0, 1, 2, 2, 0, 0,                       /* communication, abstract control */
    5, 0x24, 0, 0x10, 0x01,                          /* CDC 1.1 */
    5, 0x24, 1, 0, 1,                                /* no calls */
    4, 0x24, 2, 2,                                   /* line coding and state */
    5, 0x24, 6, 0, 1,                                /* union of both */
    7, 5, 0x80 | EP_NOTIFY, 3, 8, 0, 255,
    9, 4, 1, 0, 2, 10, 0, 0, 0,                      /* data */
    7, 5, EP_DATA, 2, PACKET, 0, 0,
    7, 5, 0x80 | EP_DATA, 2, PACKET, 0, 0,
};

static const char *const names[] = {"tomoskin", "tomoskin board"};
static uint8_t text[2u + 2u * MOST_STRING];

static void put(char letter) {
    text[text[0]] = (uint8_t)letter;
    text[text[0] + 1u] = 0u;
    text[0] = (uint8_t)(text[0] + 2u);
}

static void put_serial_number(void) {
    uint8_t id[8];
    flash_unique_id(id);
    for (size_t at = 0u; at < sizeof id; at++) {
        put("0123456789ABCDEF"[id[at] >> 4]);
        put("0123456789ABCDEF"[id[at] & 15u]);
    }
}

static struct descriptor string(uint8_t index) {
    text[0] = 2u;
    text[1] = STRING;
    if (index == 0u) {
        put(0x09); /* English, 0x0409 */
        text[3] = 0x04;
    } else if (index <= 2u) {
        for (const char *letter = names[index - 1u]; *letter != '\0'; letter++) {
            put(*letter);
        }
    } else if (index == 3u) {
        put_serial_number();
    } else {
        return (struct descriptor){text, 0u};
    }
    return (struct descriptor){text, text[0]};
}

struct descriptor descriptor_of(uint16_t value) {
    switch (value >> 8) {
    case DEVICE:
        return (struct descriptor){device, sizeof device};
    case CONFIGURATION:
        return (struct descriptor){configuration, sizeof configuration};
    case STRING:
        return string((uint8_t)value);
    default:
        return (struct descriptor){text, 0u};
    }
}
