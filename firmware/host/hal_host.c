/* The machine as a Linux process: a pty for the serial line, a skin memory for the converter.

   Interrupts come in hal_idle only, and late. So the clock stands still at the time when one is
   due until it has run: to the firmware none is ever late, and a scan takes as long as on the
   board. */
#include "host.h"

#include "hal.h"
#include "limits.h"
#include "protocol.h"
#include "scan.h"
#include "skin.h"
#include "switches.h"

#include <fcntl.h>
#include <poll.h>
#include <pty.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#define NEVER UINT64_MAX
#define NS_PER_TICK (US_PER_TICK * UINT64_C(1000))
#define NAP_NS UINT64_C(1000000)
#define IDLE_NS UINT64_C(10000000)
#define DROPPED 2u              /* conversions of a Pico after a change of channel */
#define LATE_NS UINT64_C(100000000) /* so late that the time between is given up */

static const struct skin_memory *skin;
static uint32_t current_ua;
static uint64_t started;
static uint64_t event_time; /* of the interrupt that runs; 0: none runs */
static uint64_t latest; /* that it has been in one: a dead time is not waited for, but counts */
static uint64_t timer_due = NEVER;
static uint64_t timer_from;
static uint64_t adc_due = NEVER;
static uint64_t sample_ns;
static uint8_t conversions;
static uint8_t adc_channel;
static uint8_t connected[2] = {SWITCHES_OFF, SWITCHES_OFF};
static uint8_t addressed[2];
static int line = -1;
static const uint8_t *unsent;
static uint16_t n_unsent;
static bool sending; /* and the main loop has not seen yet that all is sent */
static uint8_t unread[64];
static uint8_t n_unread;
static uint8_t next_unread;
static bool awake;

static uint64_t real_time(void) {
    struct timespec now;
    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * UINT64_C(1000000000) + (uint64_t)now.tv_nsec;
}

static uint64_t next_due(void) {
    return timer_due < adc_due ? timer_due : adc_due;
}

static uint64_t now_ns(void) {
    if (event_time != 0u) {
        return event_time;
    }
    uint64_t now = real_time();
    uint64_t due = next_due();
    now = due < now ? due : now;
    return now < latest ? latest : now;
}

static _Noreturn void give_up(const char *what) {
    perror(what);
    exit(1);
}

void host_set_up(const char *skin_path, uint32_t current, const char *link_path) {
    int terminal;
    char name[128];
    skin = skin_path != NULL ? skin_open(skin_path) : skin_star();
    current_ua = current;
    if (openpty(&line, &terminal, name, NULL, NULL) != 0) {
        give_up("no pty");
    }
    (void)fcntl(line, F_SETFL, O_NONBLOCK);
    struct termios raw;
    (void)tcgetattr(terminal, &raw); /* kept open: the line stays up without a host */
    cfmakeraw(&raw);
    (void)tcsetattr(terminal, TCSANOW, &raw);
    if (link_path != NULL) {
        (void)unlink(link_path);
        if (symlink(name, link_path) != 0) {
            give_up(link_path);
        }
    }
    (void)printf("%s\n", link_path != NULL ? link_path : name);
    (void)fflush(stdout);
}

void hal_init(void) {
    started = real_time();
}

uint8_t hal_reset_cause(void) {
    return RESET_POWER;
}

static const struct hal_board this_board = {
    .name = "Linux process",
    .most_chop_hz = 5000u,
    .half_ns = 1000u,
    .sample_ns = 1000u,
    .conversion_ns = 0u,
    .clock_ns = 813u, /* 13 clocks at 16 MHz */
};
const struct hal_board *hal_board = &this_board;

void hal_unique_id(uint8_t *id) {
    (void)memcpy(id, "host\0\0\0\0", 8);
}

uint32_t hal_current(void) {
    return current_ua;
}

bool hal_against_neighbour(void) {
    return false;
}

void hal_switches_disable(void) {
    connected[0] = connected[1] = SWITCHES_OFF;
}

void hal_switches_address(uint8_t source, uint8_t sink) {
    addressed[0] = source;
    addressed[1] = sink;
}

void hal_switches_latch(void) {
}

void hal_switches_enable(uint8_t source, uint8_t sink) {
    if (source != addressed[0] || sink != addressed[1]) {
        give_up("enabled what was not addressed");
    }
    connected[0] = source;
    connected[1] = sink;
}

uint32_t hal_ticks(void) {
    return (uint32_t)((now_ns() - started) / NS_PER_TICK);
}

void hal_listen(void) {} /* the line waits by itself */

void hal_delay_us(uint16_t us) {
    if (event_time != 0u) {
        event_time += us * UINT64_C(1000);
    }
}

void hal_timer_set(uint16_t ticks) {
    timer_from = now_ns();
    timer_due = timer_from + ticks * NS_PER_TICK;
}

void hal_timer_extend(uint16_t ticks) {
    uint64_t due = timer_from + ticks * NS_PER_TICK;
    timer_due = due > now_ns() ? due : now_ns();
}

void hal_timer_cancel(void) {
    timer_due = NEVER;
}

void hal_adc_prepare(uint8_t prescaler, uint8_t wanted) {
    conversions = wanted;
    sample_ns = ADC_BITS > 10u ? (DROPPED + wanted) * UINT64_C(2000)
                               : wanted * (prescaler * UINT64_C(13000) / 16u);
}

uint16_t hal_adc_ticks(void) {
    return (uint16_t)(sample_ns / NS_PER_TICK + 1u);
}

void hal_adc_start(uint8_t channel) {
    adc_channel = channel;
    adc_due = now_ns() + sample_ns;
}

void hal_adc_cancel(void) {
    adc_due = NEVER;
}

struct losses hal_losses(void) {
    struct losses none = {0u, 0u}; /* its clock waits, and so does its line */
    return none;
}

int16_t hal_uart_get(void) {
    if (next_unread == n_unread) {
        ssize_t got = read(line, unread, sizeof unread);
        next_unread = 0u;
        n_unread = got > 0 ? (uint8_t)got : 0u;
    }
    return next_unread == n_unread ? -1 : unread[next_unread++];
}

static void flush_line(void) {
    if (n_unsent == 0u) {
        return;
    }
    struct pollfd can = {line, POLLOUT, 0};
    if (poll(&can, 1, 0) != 1 || (can.revents & POLLOUT) == 0) {
        return;
    }
    ssize_t sent = write(line, unsent, n_unsent);
    if (sent > 0) {
        n_unsent = (uint16_t)(n_unsent - sent);
        unsent += sent;
    }
}

void hal_uart_send(const uint8_t *bytes, uint16_t size) {
    unsent = bytes;
    n_unsent = size;
    sending = true;
    flush_line();
}

bool hal_uart_busy(void) {
    flush_line();
    return n_unsent != 0u;
}

bool hal_uart_sent(void) {
    return !hal_uart_busy();
}

uint16_t hal_crc16(uint16_t crc, uint8_t byte) {
    return crc16_step(crc, byte);
}

bool hal_uart_up(void) {
    return true; /* it has no way to tell */
}

bool hal_uart_can(uint32_t baud) {
    return baud >= 9600u && baud <= FIRST_BAUD;
}

void hal_uart_set_baud(uint32_t baud) {
    (void)baud; /* a pty has none */
}

void hal_lock(void) {
}

void hal_unlock(void) {
}

void hal_wake(void) {
    awake = true;
}

static bool deliver(uint64_t until) {
    uint64_t due = next_due();
    if (due > until) {
        return false;
    }
    event_time = due;
    if (due == timer_due) {
        timer_due = NEVER;
        scan_on_timer();
    } else {
        adc_due = NEVER;
        uint16_t sum = 0u;
        for (uint8_t left = conversions; left != 0u; left--) {
            sum = (uint16_t)(sum + skin_code(skin, connected[0], connected[1], adc_channel));
        }
        scan_on_sample(sum);
    }
    latest = event_time;
    event_time = 0u;
    return true;
}

/* After a long stop of the process nothing is caught up: the clock has stood still. */
static void give_up_lost_time(uint64_t now) {
    uint64_t due = next_due();
    if (due == NEVER || due + LATE_NS >= now) {
        return;
    }
    uint64_t lost = now - due;
    started += lost;
    timer_due = timer_due == NEVER ? NEVER : timer_due + lost;
    adc_due = adc_due == NEVER ? NEVER : adc_due + lost;
}

void hal_idle(void) {
    uint64_t now = real_time();
    flush_line();
    if (sending && n_unsent == 0u) { /* before more of the scan: a frame is to be given back */
        sending = false;
        return;
    }
    give_up_lost_time(now);
    awake = false;
    while (!awake && deliver(now)) {
    }
    if (awake) {
        return;
    }
    bool busy = timer_due != NEVER || adc_due != NEVER || n_unsent != 0u;
    uint64_t nap = busy ? NAP_NS : IDLE_NS;
    struct pollfd wait = {line, POLLIN, 0};
    (void)poll(&wait, 1, (int)(nap / UINT64_C(1000000)));
    if ((wait.revents & POLLHUP) != 0) {
        struct timespec pause = {0, (long)nap};
        (void)nanosleep(&pause, NULL);
    }
}

void hal_watchdog_kick(void) {
}
