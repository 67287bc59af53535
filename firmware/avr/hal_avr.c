/* The machine as an ATmega2560 at 16 MHz: timer 1 is the scan's, timer 3 counts ticks of 4 us, timer
   0 wakes the main loop every 16 ms; USART 0 the host; the converter one conversion at a time,
   started in the interrupt of the one before. Each timer has one task: writing a compare register
   disturbs the other channels of a timer in simavr.

   Which interrupt runs first is fixed: timer 1, then what is received and sent, then the converter,
   then timer 3. Bytes may come and go every 10 us, which is about what the processor needs for both.
   So the scan's timer stands before them, and sending lets the converter in: a host that talks must
   not lengthen a drive. */
#include "hal.h"

#include "crc.h"
#include "limits.h"
#include "pins.h"
#include "protocol.h"
#include "scan.h"

#include <avr/eeprom.h>
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
#include <avr/wdt.h>
#include <stddef.h>
#include <string.h>
#include <util/delay_basic.h>

static_assert(CHANNELS <= 16u, "a Mega's board has at most 16 channels; a Pico's has 32");

#define BY_64(timer) (_BV(CS##timer##1) | _BV(CS##timer##0)) /* 4 us */
#define RECEIVE_SIZE 128u
#define CLOCKS_PER_CONVERSION 14u /* 13, and up to one to begin with */
#define CLOCKS_PER_TICK 64u        /* 16 MHz */

/* Set by `tomoskin firmware configure`; an EEPROM that was never written reads 0xFF. */
struct identity {
    uint32_t current; /* uA */
    uint8_t unique_id[8];
    uint16_t checksum; /* CRC-16 of what is before it, as on the line */
};
static EEMEM struct identity stored;
static struct identity identity; /* what of it may be used */

/* What a reset leaves as it was, but power coming up does not. */
#define NOINIT __attribute__((section(".noinit")))
#define REMEMBERED UINT32_C(0x746F6D6F)
static NOINIT uint8_t reset_flags, serial_before;
static NOINIT uint32_t memory;
static NOINIT struct losses losses; /* opening a port resets the board, and must not forget them */
static bool remembers;
static volatile uint16_t ticks_high;
static volatile bool awake;
static uint8_t converter; /* ADCSRA without the start bit */
static uint8_t conversions, conversions_left;
static uint16_t conversion_sum;
static uint16_t sample_ticks;

static const uint8_t *volatile next_to_send;
static volatile uint16_t left_to_send;
static uint8_t received[RECEIVE_SIZE];
static volatile uint8_t receive_first, receive_end;

/* Before main: the enables low before anything is an output; the watchdog off that the bootloader
   or the reset has left on. */
void first_of_all(void) __attribute__((naked, used, section(".init3")));
void first_of_all(void) {
    CONTROL_PORT = LATCH;
    CONTROL_DDR = ENABLES | LATCH;
    reset_flags = MCUSR;
    serial_before = UCSR0B;
    MCUSR = 0u;
    wdt_disable();
}

/* A single wrong bit could make 100 mA of 10: what is damaged is not used. */
static void read_identity(void) {
    const uint8_t *byte = (const uint8_t *)&identity;
    uint16_t crc = 0xFFFFu;
    bool written = false;
    eeprom_read_block(&identity, &stored, sizeof identity);
    for (uint8_t at = 0u; at < sizeof identity; at++) {
        written = written || byte[at] != 0xFFu;
        if (at < offsetof(struct identity, checksum)) {
            crc = crc16_by_table(crc, byte[at]);
        }
    }
    if (!written) {
        identity.current = BOARD_CURRENT_UA;
    } else if (crc != identity.checksum) {
        (void)memset(&identity, 0xFF, sizeof identity);
        identity.current = CURRENT_DAMAGED;
    }
}

void hal_init(void) {
    read_identity();
    remembers = memory == REMEMBERED;
    if (!remembers) {
        losses = (struct losses){0u, 0u};
    }
    memory = REMEMBERED;
    ADDRESS_PORT = 0u;
    ADDRESS_DDR = ADDRESS_MASK;
    DIDR0 = 0xFFu; /* digital inputs off where potentials come in */
    DIDR2 = 0xFFu;
    TCCR3A = 0u;
    TCCR3B = BY_64(3);
    TIMSK3 = _BV(TOIE3);
    TCCR0A = 0u;
    TCCR0B = _BV(CS02) | _BV(CS00); /* 64 us; an overflow every 16.4 ms */
    TIMSK0 = _BV(TOIE0);
    TCCR1A = 0u;
    hal_uart_set_baud(FIRST_BAUD);
    UCSR0C = _BV(UCSZ01) | _BV(UCSZ00);
    UCSR0B = _BV(RXCIE0) | _BV(RXEN0) | _BV(TXEN0);
    SMCR = 0u; /* idle: timer, line and converter go on */
    wdt_enable(WDTO_120MS);
    sei();
}

/* Behind the stock bootloader, which clears MCUSR. It hands a watchdog's reset over at once; before
   all others it has set up the serial line. A brown-out that leaves the memory cannot be told from
   the reset line there; one that does not is power coming up. */
static uint8_t cause_behind_bootloader(void) {
    if (!remembers) {
        return RESET_POWER;
    }
    if (serial_before == 0u) {
        return RESET_WATCHDOG;
    }
    return serial_before == (_BV(RXEN0) | _BV(TXEN0)) ? RESET_EXTERNAL : RESET_UNKNOWN;
}

uint8_t hal_reset_cause(void) {
    if (reset_flags == 0u) {
        return cause_behind_bootloader();
    }
    if ((reset_flags & _BV(WDRF)) != 0u) {
        return RESET_WATCHDOG;
    }
    if ((reset_flags & _BV(PORF)) != 0u) {
        return RESET_POWER; /* power coming up sets the brown-out flag too */
    }
    if ((reset_flags & _BV(BORF)) != 0u) {
        return RESET_BROWN_OUT;
    }
    return (reset_flags & _BV(EXTRF)) != 0u ? RESET_EXTERNAL : RESET_UNKNOWN;
}

static const struct hal_board this_board = {
    .name = "Arduino Mega 2560",
    .most_chop_hz = 1000u,
    .half_ns = 40000u,
    .sample_ns = 12000u,
    .conversion_ns = 4000u,
    .clock_ns = 1000u * CLOCKS_PER_CONVERSION / 16u, /* 16 MHz */
};
const struct hal_board *hal_board = &this_board;

void hal_unique_id(uint8_t *id) {
    (void)memcpy(id, identity.unique_id, sizeof identity.unique_id);
}

uint32_t hal_current(void) {
    return identity.current;
}

static inline __attribute__((always_inline)) void take_byte(void) {
    bool overrun = (UCSR0A & _BV(DOR0)) != 0u; /* nobody looked for three bytes; read before UDR0 */
    uint8_t byte = UDR0;
    uint8_t next = (uint8_t)((receive_end + 1u) % RECEIVE_SIZE);
    bool full = next == receive_first;
    if (!full) {
        received[receive_end] = byte;
        receive_end = next;
    }
    if (overrun || full) {
        losses.bytes++;
    }
    awake = true;
}

void hal_listen(void) {
    while ((UCSR0A & _BV(RXC0)) != 0u) {
        take_byte();
    }
}

bool hal_against_neighbour(void) {
    return false; /* a jumper chooses, which nobody here can see: the host asks the skin file */
}

void hal_switches_disable(void) {
    CONTROL_PORT = LATCH;
}

void hal_switches_address(uint8_t source, uint8_t sink) {
    ADDRESS_PORT = (uint8_t)((source & 7u) | (uint8_t)((sink & 7u) << SINK_SHIFT));
}

void hal_switches_latch(void) {
    CONTROL_PORT = 0u;
    CONTROL_PORT = LATCH;
}

void hal_switches_enable(uint8_t source, uint8_t sink) {
    CONTROL_PORT = (uint8_t)(LATCH | (source < 8u ? SOURCE_ENABLE_0 : SOURCE_ENABLE_8) |
                             (sink < 8u ? SINK_ENABLE_0 : SINK_ENABLE_8));
}

uint32_t hal_ticks(void) {
    uint8_t state = SREG;
    cli();
    uint16_t low = TCNT3;
    uint16_t high = ticks_high;
    if ((TIFR3 & _BV(TOV3)) != 0u && low < 0x8000u) {
        high++; /* it has overflowed, and the interrupt has not run yet */
    }
    SREG = state;
    return ((uint32_t)high << 16) | low;
}

void hal_delay_us(uint16_t us) {
    while (us-- != 0u) {
        if ((UCSR0A & _BV(RXC0)) != 0u) {
            take_byte();
        }
        _delay_loop_1(3); /* 9 cycles, and 9 for loop and line */
    }
}

void hal_timer_set(uint16_t ticks) {
    TCCR1B = 0u;
    TCNT1 = 0u;
    OCR1A = ticks;
    TIFR1 = _BV(OCF1A);
    TIMSK1 = _BV(OCIE1A);
    TCCR1B = BY_64(1);
}

void hal_timer_extend(uint16_t ticks) {
    uint16_t gone = TCNT1;
    hal_timer_set(ticks > gone + 1u ? (uint16_t)(ticks - gone) : 1u);
}

void hal_timer_cancel(void) {
    TIMSK1 = 0u;
    TCCR1B = 0u;
}

void hal_adc_prepare(uint8_t prescaler, uint8_t wanted) {
    uint8_t power = 4u;
    conversions = wanted;
    sample_ticks = (uint16_t)(wanted * (CLOCKS_PER_CONVERSION * prescaler / CLOCKS_PER_TICK + 1u));
    for (uint8_t by = 16u; by != prescaler && power < 7u; power++) {
        by = (uint8_t)(by << 1);
    }
    ADMUX = _BV(REFS0);
    converter = (uint8_t)(_BV(ADEN) | _BV(ADIE) | power);
    ADCSRA = (uint8_t)(converter | _BV(ADIF));
}

uint16_t hal_adc_ticks(void) {
    return sample_ticks;
}

void hal_adc_start(uint8_t channel) {
    conversions_left = conversions;
    conversion_sum = 0u;
    ADCSRB = channel < 8u ? 0u : _BV(MUX5);
    ADMUX = (uint8_t)(_BV(REFS0) | (channel & 7u));
    ADCSRA = (uint8_t)(converter | _BV(ADSC));
}

void hal_adc_cancel(void) {
    ADCSRA = _BV(ADIF); /* off: a conversion under way is dropped */
}

/* Of conversions it loses none: the next one begins in the interrupt of the one before. */
struct losses hal_losses(void) {
    return losses;
}

int16_t hal_uart_get(void) {
    uint8_t at = receive_first;
    if (at == receive_end) {
        return -1;
    }
    uint8_t byte = received[at];
    receive_first = (uint8_t)((at + 1u) % RECEIVE_SIZE);
    return byte;
}

void hal_uart_send(const uint8_t *bytes, uint16_t size) {
    next_to_send = bytes;
    left_to_send = size;
    UCSR0B |= _BV(UDRIE0);
}

bool hal_uart_busy(void) {
    return (UCSR0B & _BV(UDRIE0)) != 0u; /* the interrupt leaves it on while bytes are left */
}

bool hal_uart_sent(void) {
    return !hal_uart_busy() && (UCSR0A & _BV(TXC0)) != 0u;
}

static uint16_t divider(uint32_t baud) {
    return (uint16_t)((F_CPU / 8u + baud / 2u) / baud - 1u);
}

bool hal_uart_up(void) {
    return true; /* it has no way to tell */
}

bool hal_uart_can(uint32_t baud) {
    if (baud < 9600u || baud > FIRST_BAUD) {
        return false;
    }
    uint32_t exact = F_CPU / 8u;
    uint32_t off = exact % baud;
    off = off > baud / 2u ? baud - off : off;
    return off <= exact / 45u; /* 2.2 % */
}

void hal_uart_set_baud(uint32_t baud) {
    UCSR0A = _BV(U2X0); /* before UBRR */
    UBRR0 = divider(baud);
}

uint16_t hal_crc16(uint16_t crc, uint8_t byte) {
    return crc16_by_table(crc, byte);
}

void hal_lock(void) {
    cli();
}

void hal_unlock(void) {
    sei();
}

void hal_wake(void) {
    awake = true;
}

void hal_idle(void) {
    cli();
    while (!awake) {
        SMCR = _BV(SE);
        sei(); /* the next instruction still runs: no wake-up is lost */
        sleep_cpu();
        SMCR = 0u;
        cli();
    }
    awake = false;
    sei();
}

void hal_watchdog_kick(void) {
    wdt_reset();
}

ISR(TIMER3_OVF_vect) {
    ticks_high++;
}

ISR(TIMER0_OVF_vect) {
    awake = true;
}

ISR(TIMER1_COMPA_vect) {
    TIMSK1 = 0u; /* it counts on: it may be extended */
    scan_on_timer();
}

ISR(ADC_vect) {
    uint16_t code = ADC;
    if (--conversions_left == 0u) {
        scan_on_sample((uint16_t)(conversion_sum + code));
        return;
    }
    ADCSRA = (uint8_t)(converter | _BV(ADSC)); /* it runs while this one is added */
    conversion_sum = (uint16_t)(conversion_sum + code);
}

ISR(USART0_RX_vect) {
    take_byte();
}

/* Other interrupts run meanwhile: this one is switched off, and again on as its last act. */
ISR(USART0_UDRE_vect) {
    UCSR0B &= (uint8_t)~_BV(UDRIE0);
    sei();
    const uint8_t *at = next_to_send;
    uint16_t left = (uint16_t)(left_to_send - 1u);
    next_to_send = at + 1;
    left_to_send = left;
    cli();
    if (left == 0u) {
        UCSR0A = _BV(U2X0) | _BV(TXC0); /* clears the flag: set again when this byte has left */
        awake = true;
    } else {
        UCSR0B |= _BV(UDRIE0);
    }
    UDR0 = *at;
}
