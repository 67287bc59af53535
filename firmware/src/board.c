#include "board.h"

#include "commands.h"
#include "framing.h"
#include "hal.h"
#include "limits.h"
#include "link.h"
#include "protocol.h"
#include "scan.h"
#include "switches.h"

#include <stdbool.h>
#include <stdint.h>

#define HELLO_TICKS (500u * TICKS_PER_MS)
#define BAUD_TRIAL_TICKS (1000u * TICKS_PER_MS)

static struct {
    uint32_t ticks; /* of this round */
    uint32_t ticks_high;
    uint32_t heard;
    uint32_t said_hello;
    bool hello_due;  /* HELLO is said until a command arrives */
    bool hello_now;
    uint8_t reset_cause;
    struct scan_fault fault; /* to be said */
    struct incoming incoming;
    uint32_t baud;      /* in use */
    uint32_t next_baud; /* as soon as the answer is sent; 0: none */
    uint32_t old_baud;  /* to go back to unless a command arrives; 0: settled */
    uint32_t baud_since;
} board;

static void say_hello_until_spoken_to(void) {
    board.hello_due = true;
    board.hello_now = true;
}

static void note_fault(uint8_t code, uint16_t detail) {
    board.fault.code = code;
    board.fault.detail = detail;
}

void board_start(void) {
    hal_init();
    switches_off();
    hal_lock();
    scan_stop();
    hal_unlock();
    link_reset();
    commands_reset();
    board.ticks = board.heard = hal_ticks();
    board.ticks_high = 0u;
    board.reset_cause = hal_reset_cause();
    board.incoming.size = 0u;
    board.incoming.overlong = false;
    board.baud = FIRST_BAUD;
    board.next_baud = board.old_baud = 0u;
    note_fault(board.reset_cause == RESET_WATCHDOG    ? FAULT_WATCHDOG
               : board.reset_cause == RESET_BROWN_OUT ? FAULT_BROWN_OUT
                                                      : 0u,
               0u);
    say_hello_until_spoken_to();
}

static void heard(void) {
    board.heard = board.ticks;
    board.hello_due = board.hello_now = false;
    board.old_baud = 0u;
}

static void receive(void) {
    while (link_free() && board.next_baud == 0u) {
        int16_t byte = hal_uart_get();
        if (byte < 0) {
            return;
        }
        uint8_t size = incoming_take(&board.incoming, (uint8_t)byte);
        if (size != 0u && commands_take(board.incoming.block, size, board.reset_cause)) {
            heard();
            board.next_baud = commands_take_baud();
        }
    }
}

static void use_baud(uint32_t baud) {
    hal_uart_set_baud(baud);
    board.baud = baud;
}

static void mind_baud(void) {
    if (board.next_baud != 0u && link_sent()) {
        board.old_baud = board.baud;
        board.baud_since = board.ticks;
        use_baud(board.next_baud);
        board.next_baud = 0u;
    } else if (board.old_baud != 0u && board.ticks - board.baud_since >= BAUD_TRIAL_TICKS) {
        use_baud(board.old_baud);
        board.old_baud = 0u;
    }
}

static void mind_host(void) {
    bool silent = board.ticks - board.heard >= commands_heartbeat() || !hal_uart_up();
    if (board.hello_due || !silent) {
        return;
    }
    hal_lock();
    bool was_running = scan_running();
    scan_stop();
    hal_unlock();
    if (was_running) {
        note_fault(FAULT_HOST_SILENT, 0u);
    }
    commands_forget_last();
    say_hello_until_spoken_to();
}

static void mind_scan(void) {
    hal_lock();
    scan_guard(hal_ticks());
    struct scan_fault found = scan_take_fault();
    hal_unlock();
    if (found.code != 0u) {
        note_fault(found.code, found.detail);
    }
}

static void speak(void) {
    if (board.fault.code != 0u && link_free()) {
        link_say_fault(board.ticks_high, board.ticks, board.fault.code, board.fault.detail);
        board.fault.code = 0u;
    }
    if (board.hello_due && board.ticks - board.said_hello >= HELLO_TICKS) {
        board.hello_now = true;
    }
    if (board.hello_now && link_free()) {
        link_say_hello();
        board.hello_now = false;
        board.said_hello = board.ticks;
    }
    link_send(board.ticks_high, board.ticks);
}

void board_step(void) {
    hal_watchdog_kick();
    uint32_t now = hal_ticks();
    if (now < board.ticks) {
        board.ticks_high++;
    }
    board.ticks = now;
    mind_scan();
    receive();
    mind_baud();
    mind_host();
    speak();
}
