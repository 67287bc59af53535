/* In place of main.c, for a test: whether the clock jumps where its two halves meet. It is read in each
   cycle around an overflow of its lower half; "." on the serial line: it never jumped, "x": it did. */
#include "hal.h"

#include <avr/io.h>
#include <util/delay_basic.h>

#define BEFORE 0xFFFEu /* simavr takes the last value for 0 */
#define CYCLES 250u    /* around the overflow, which comes up to 128 after that */
#define LONGEST_TICKS 8u /* between two looks, with interrupts in between; a jump is 65536 */
#define NOTHING __asm__ volatile("nop")

static void wait(uint8_t cycles) {
    _delay_loop_1((uint8_t)(cycles / 3u + 1u)); /* 3 cycles each */
    if (cycles % 3u == 1u) {
        NOTHING;
    } else if (cycles % 3u == 2u) {
        NOTHING;
        NOTHING;
    }
}

static uint8_t said;

int main(void) {
    hal_init();
    for (;;) {
        while (hal_uart_busy()) {
        }
        said = '.';
        for (uint8_t cycles = 0u; cycles < CYCLES; cycles++) {
            TCNT3 = BEFORE;
            wait(cycles);
            uint32_t first = hal_ticks();
            uint32_t second = hal_ticks();
            if (second - first > LONGEST_TICKS) {
                said = 'x';
            }
        }
        hal_watchdog_kick();
        hal_uart_send(&said, 1u);
    }
}
