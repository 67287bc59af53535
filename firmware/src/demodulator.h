/* What turns with the current, and what does not: sums of a drive's conversions in both directions. */
#ifndef TOMOSKIN_DEMODULATOR_H
#define TOMOSKIN_DEMODULATOR_H

#include <stdbool.h>
#include <stdint.h>

#define DEMODULATED_ZERO 0x8000u /* stands for no difference */

void demodulator_clear(void);

/* Conversions of a channel, with the current from source to sink or `reversed`. */
void demodulator_add(uint8_t channel, bool reversed, uint16_t sum);

/* The values of FRAME_CHOPPED. Neither overflows: either direction has half of what fits a sample. */
uint16_t demodulator_difference(uint8_t channel);
uint16_t demodulator_sum(uint8_t channel);

#endif
