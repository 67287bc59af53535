/* What the portable firmware needs of a machine; each folder beside src/ links one.
   Functions named *_on_* are the firmware's own, called by the machine, from interrupts where it
   has them. */
#ifndef TOMOSKIN_HAL_H
#define TOMOSKIN_HAL_H

#include <stdbool.h>
#include <stdint.h>

#define TICKS_PER_SECOND UINT32_C(250000)
#define TICKS_PER_MS UINT32_C(250)
#define US_PER_TICK 4u

/* Pins safe before anything else; then clock, serial line, watchdog. */
void hal_init(void);

/* Why the machine started: RESET_... of the protocol. */
uint8_t hal_reset_cause(void);

/* Its name for people, and what half a period of the alternating drive takes: BOARD of the protocol. */
struct hal_board {
    const char *name; /* at most 24 bytes */
    uint16_t most_chop_hz;
    uint16_t half_ns;
    uint16_t sample_ns;
    uint16_t conversion_ns;
    uint16_t clock_ns;
};
extern const struct hal_board *hal_board; /* after hal_init */

/* (eight bytes) tells one board from another; and the setting of its current limiter in uA, or
   CURRENT_DAMAGED where its memory holds something that nobody has written. */
#define CURRENT_DAMAGED UINT32_MAX
void hal_unique_id(uint8_t *id);
uint32_t hal_current(void);

/* Whether what is read is against the electrode before the sink, not against the sink's line, for all
   that the firmware knows. */
bool hal_against_neighbour(void);

/* Switches. Only switches.c may call these. Address and latch do not connect anything. */
void hal_switches_disable(void);
void hal_switches_address(uint8_t source, uint8_t sink);
void hal_switches_latch(void);
void hal_switches_enable(uint8_t source, uint8_t sink);

/* Clock: ticks since start, modulo 2^32; and a busy wait. */
uint32_t hal_ticks(void);
void hal_delay_us(uint16_t us);

/* One timer: scan_on_timer() comes no sooner than `ticks` from now; setting it again replaces it. */
void hal_timer_set(uint16_t ticks);
/* Once more, `ticks` after it was set; at once where those have gone by. */
void hal_timer_extend(uint16_t ticks);
void hal_timer_cancel(void);

/* Converter: scan_on_sample(sum) comes once for each start: the sum of as many conversions of the
   channel as prepare said. ticks: how long a sample takes, at most. */
void hal_adc_prepare(uint8_t prescaler, uint8_t conversions);
uint16_t hal_adc_ticks(void);
void hal_adc_start(uint8_t channel);
void hal_adc_cancel(void);

/* What was lost since power came up, modulo 2^16: conversions, since an interrupt came after the
   converter's memory was full; bytes from the host, since nobody took them in time. Under lock. */
struct losses {
    uint16_t conversions;
    uint16_t bytes;
};
struct losses hal_losses(void);

/* Serial line. get: -1 when there is nothing. send: the bytes are read as they go, and may be
   changed when `busy` has become false; only then the next. sent: they have left the machine. */
int16_t hal_uart_get(void);
void hal_uart_send(const uint8_t *bytes, uint16_t size);
bool hal_uart_busy(void);
bool hal_uart_sent(void);
/* Whether there may be a host: false once its cable has been pulled, where the machine can tell. */
bool hal_uart_up(void);
bool hal_uart_can(uint32_t baud);
void hal_uart_set_baud(uint32_t baud);

/* One step of CRC-16/CCITT: by arithmetic, or faster where the machine knows a way. */
uint16_t hal_crc16(uint16_t crc, uint8_t byte);
static inline uint16_t crc16_step(uint16_t crc, uint8_t byte) {
    uint8_t x = (uint8_t)((uint8_t)(crc >> 8) ^ byte);
    x ^= (uint8_t)(x >> 4);
    return (uint16_t)((uint16_t)(crc << 8) ^ (uint16_t)((uint16_t)x << 12) ^
                      (uint16_t)((uint16_t)x << 5) ^ x);
}

/* Between lock and unlock, and in scan_on_..., it is called every 20 us or sooner: where bytes come by
   an interrupt, the line has no more room than for two. */
void hal_listen(void);

/* Between lock and unlock no scan_on_... comes. Not nested; not from scan_on_.... */
void hal_lock(void);
void hal_unlock(void);

/* idle sleeps until wake has been called, a byte has come, all is sent, or some 10 ms have gone by. */
void hal_wake(void);
void hal_idle(void);

/* Without a kick for 120 ms the machine resets. */
void hal_watchdog_kick(void);

#endif
