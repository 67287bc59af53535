/* The switches of the drive: the one function that may move them. */
#ifndef TOMOSKIN_SWITCHES_H
#define TOMOSKIN_SWITCHES_H

#include <stdbool.h>
#include <stdint.h>

#define SWITCHES_OFF 0xFFu

/* Whatever is asked for, the dead time is at least this: a transistor needs it to open. */
#define LEAST_DEAD_TIME_US 1u

/* All channels high-impedance; then, unless both are SWITCHES_OFF, after `dead_time` us the source
   at the current and the sink at ground. False, and all off, when that is forbidden. */
bool switches_set(uint8_t source, uint8_t sink, uint16_t dead_time);

static inline void switches_off(void) {
    (void)switches_set(SWITCHES_OFF, SWITCHES_OFF, 0u);
}

#endif
