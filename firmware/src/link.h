/* Messages to the host: one small one and the frames, in turn. */
#ifndef TOMOSKIN_LINK_H
#define TOMOSKIN_LINK_H

#include <stdbool.h>
#include <stdint.h>

void link_reset(void);

/* Whether a small message can be taken; while one waits, no further one. */
bool link_free(void);
void link_say_hello(void);
void link_say_info(uint8_t request, uint8_t reset_cause);
void link_say_ack(uint8_t request, uint8_t command, uint8_t result, uint16_t detail);
void link_say_scan(uint8_t request);
void link_say_mode(uint8_t request);
void link_say_board(uint8_t request);
void link_say_losses(uint8_t request);
void link_say_pattern(uint8_t request, uint16_t first); /* `first` is one of the drives */
void link_say_fault(uint32_t ticks_high, uint32_t ticks, uint8_t code, uint16_t detail);

/* Give the line the next message when it is free. `now`: 64 bits of the clock. */
void link_send(uint32_t now_high, uint32_t now);

/* Whether everything said has left the device. */
bool link_sent(void);

#endif
