/* The configuration of the scan: what the host has set, checked. */
#ifndef TOMOSKIN_CONFIG_H
#define TOMOSKIN_CONFIG_H

#include "limits.h"

#include <stdbool.h>
#include <stdint.h>

#define UNSET 0xFFu /* source and sink of a drive that has not been set */

struct drive {
    uint8_t source;
    uint8_t sink;
    channel_set mask;
};

struct config {
    uint16_t identity; /* 0: none */
    uint16_t n_drives;
    uint32_t settling;  /* us */
    uint16_t dead_time; /* us */
    uint8_t oversampling;
    uint8_t prescaler;
    uint8_t format;
    uint8_t mode;
    uint8_t periods;    /* of a drive, where it is chopped */
    uint16_t frequency; /* Hz, of that */
    uint32_t current_limit; /* uA */
    struct drive drives[MOST_DRIVES];
};

/* Result and detail of an ACK. */
struct verdict {
    uint8_t result;
    uint16_t detail;
};

extern struct config config;

void config_forget(void);

/* Each takes the payload of its command, of the right length; refused, it changes nothing. */
struct verdict config_set_scan(const uint8_t *payload);
struct verdict config_set_pattern(const uint8_t *payload, uint8_t size);
struct verdict config_set_format(const uint8_t *payload);
struct verdict config_set_mode(const uint8_t *payload);
struct verdict config_check_start(uint16_t identity);

/* Whether the order of a SET_ORDER can be scanned. */
struct verdict config_check_order(const uint8_t *payload, uint8_t size);

/* Whether each drive is a message of its own; whether samples have ten bits. */
bool config_singly(void);
bool config_packed(void);

/* Directions of a drive, one after the other; conversions of a channel in each. */
uint8_t config_directions(void);
uint8_t config_conversions(void);

/* At least `us`: one tick more, since the present one has begun already. */
uint16_t config_ticks(uint32_t us);

#endif
