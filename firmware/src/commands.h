/* Commands of the host: checked, run once, answered. */
#ifndef TOMOSKIN_COMMANDS_H
#define TOMOSKIN_COMMANDS_H

#include <stdbool.h>
#include <stdint.h>

#define FIRST_HEARTBEAT_MS 2000u

/* After reset, and when the host has fallen silent. */
void commands_forget_last(void);
void commands_reset(void);

/* Obey a payload with a right checksum; the link must be free. Whether it was a valid command. */
bool commands_take(const uint8_t *payload, uint8_t size, uint8_t reset_cause);

/* Host silence that is tolerated, in ticks. */
uint32_t commands_heartbeat(void);

/* The rate that SET_BAUD has asked for, once; 0: none. */
uint32_t commands_take_baud(void);

#endif
