/* The scan engine: drives, waits, converts, fills frames. It runs in interrupts. */
#ifndef TOMOSKIN_SCAN_H
#define TOMOSKIN_SCAN_H

#include "framing.h"
#include "limits.h"
#include "protocol.h"

#include <assert.h>
#include <stdbool.h>
#include <stdint.h>

#define MOST_FRAME (SIZE_FRAME + 2u * MOST_SAMPLES)
static_assert(MOST_FRAME + CHECKSUM_SIZE <= MOST_FROM_DEVICE, "a host takes such a frame");

/* Drives of an order. */
#define MOST_ORDER (MOST_TO_DEVICE - CHECKSUM_SIZE - SIZE_SET_ORDER)

#define MOST_DRIVE_SAMPLES (SIZE_DRIVE_SAMPLES + 4u * CHANNELS)

/* A whole frame, or one drive of it: its samples lie where the payload has them, the head is still
   to be written. */
struct frame {
    uint8_t *buffer;
    uint32_t started; /* tick */
    uint32_t sequence;
    uint16_t drops;
    uint16_t size; /* of the payload */
    uint8_t flags;
    uint8_t order; /* this and what follows: of a drive */
    uint8_t place;
    uint8_t drive;
};

/* What made the scan stop itself; `code` 0: nothing. */
struct scan_fault {
    uint8_t code;
    uint16_t detail;
};

/* Interrupts. */
void scan_on_timer(void);
void scan_on_sample(uint16_t sum);

/* The configuration must be complete, and no scan may run. Not under lock. */
void scan_start(void);

/* Which drives are scanned from the end of the present one on, checked; none: full turns. Under lock. */
void scan_order(uint8_t identity, const uint8_t *drives, uint8_t count);

/* All channels high-impedance; frames not yet taken are forgotten. Under lock. */
void scan_stop(void);
bool scan_running(void);

/* Stop a drive that is on for longer than it can need. Under lock, often. */
void scan_guard(uint32_t now);

/* What stopped the scan, once. Under lock. */
struct scan_fault scan_take_fault(void);

/* The oldest whole frame or drive, or NULL; it is the caller's until given back. Under lock. */
struct frame *scan_take(void);
void scan_give_back(void);

#endif
