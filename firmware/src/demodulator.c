#include "demodulator.h"

#include "limits.h"

static struct {
    uint16_t ahead;
    uint16_t reversed;
} sums[CHANNELS];

void demodulator_clear(void) {
    for (uint8_t channel = 0u; channel < CHANNELS; channel++) {
        sums[channel].ahead = sums[channel].reversed = 0u;
    }
}

void demodulator_add(uint8_t channel, bool reversed, uint16_t sum) {
    uint16_t *at = reversed ? &sums[channel].reversed : &sums[channel].ahead;
    *at = (uint16_t)(*at + sum);
}

uint16_t demodulator_difference(uint8_t channel) {
    return (uint16_t)(DEMODULATED_ZERO + sums[channel].ahead - sums[channel].reversed);
}

uint16_t demodulator_sum(uint8_t channel) {
    return (uint16_t)(sums[channel].ahead + sums[channel].reversed);
}
