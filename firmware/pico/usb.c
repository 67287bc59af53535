/* The USB device: endpoint 0 answers the host's requests, endpoint 2 is the serial line. One buffer
   for each endpoint and direction; the interrupt moves them on. */
#include "usb.h"

#include "clocks.h"
#include "descriptors.h"
#include "hal.h"
#include "limits.h"
#include "rp2040.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#define NOTIFY_DATA (USB_MEMORY + 0x180u)
#define IN_DATA (USB_MEMORY + 0x1C0u)
#define OUT_DATA (USB_MEMORY + 0x200u)
#define BIT_IN(endpoint) (1u << (2u * (endpoint)))
#define BIT_OUT(endpoint) (2u << (2u * (endpoint)))
#define CODING_SIZE 7u
#define MOST_ADDRESS 127u
#define TO_HOST 0x80u
#define KIND_MASK 0x60u
#define RECIPIENT_MASK 0x1Fu
#define OF_INTERFACE 1u
#define OF_ENDPOINT 2u
#define ENDPOINT_HALT 0u

/* Requests; with the class's bit in the upper byte. */
enum {
    GET_STATUS = 0x00,
    CLEAR_FEATURE = 0x01,
    SET_FEATURE = 0x03,
    SET_ADDRESS = 0x05,
    GET_DESCRIPTOR = 0x06,
    GET_CONFIGURATION = 0x08,
    SET_CONFIGURATION = 0x09,
    SET_INTERFACE = 0x0B,
    SET_LINE_CODING = 0x2020,
    GET_LINE_CODING = 0x2021,
    SET_CONTROL_LINE_STATE = 0x2022,
};

struct setup {
    uint8_t kind;
    uint8_t request;
    uint16_t value;
    uint16_t index;
    uint16_t length;
};

static struct {
    const uint8_t *answer; /* of endpoint 0, what is left of it */
    uint16_t left;
    bool zero_follows; /* it ends with a packet of none */
    bool takes_coding; /* the next packet out is a line coding */
    uint8_t address;   /* from the end of this request on; 0: none */
    uint32_t pid;      /* of endpoint 0's next packet in */
} control;

static struct {
    const uint8_t *bytes;
    uint16_t left;
    uint32_t pid;
    bool zero_follows; /* the last packet is full: the host waits for a shorter one */
    bool begun;
    bool occupied; /* a packet waits for the host */
    volatile bool busy;
} sending;

static struct {
    volatile uint8_t size; /* of the packet that has come; 0: none */
    uint8_t next;
    uint32_t pid;
} received;

static uint8_t coding[CODING_SIZE] = {0x40, 0x42, 0x0F, 0x00, 0, 0, 8}; /* 1 MBd, 8N1 */
static volatile bool configured;
static volatile bool suspended;

/* The controller runs by another clock: AVAILABLE comes after the rest. */
static void give(uint32_t control_at, uint32_t value) {
    REGISTER(control_at) = value;
    for (uint32_t wait = 0u; wait < 4u; wait++) {
        __asm volatile("nop");
    }
    REGISTER(control_at) = value | USB_AVAILABLE;
}

static void copy_to(uint32_t memory, const uint8_t *bytes, uint16_t size) {
    for (uint16_t at = 0u; at < size; at++) {
        BYTES(memory)[at] = bytes[at];
    }
}

static void listen(void) {
    received.next = 0u;
    received.size = 0u;
    give(USB_BUFFER_OUT(EP_DATA), received.pid | PACKET);
    received.pid ^= USB_DATA1;
}

/* The next packet is of DATA0 again, and so is one that waits: USB 2.0, 9.4.5. */
static void restart_toggle(uint32_t buffer, uint32_t *pid) {
    uint32_t held = REGISTER(buffer);
    *pid = 0u;
    if ((held & USB_AVAILABLE) != 0u) {
        give(buffer, held & ~(USB_AVAILABLE | USB_DATA1));
        *pid = USB_DATA1;
    }
}

static void restart_toggles(uint16_t index) {
    if (index == (EP_DATA | TO_HOST)) {
        restart_toggle(USB_BUFFER_IN(EP_DATA), &sending.pid);
    } else if (index == EP_DATA) {
        restart_toggle(USB_BUFFER_OUT(EP_DATA), &received.pid);
    }
}

static void give_packet(const uint8_t *bytes, uint16_t size) {
    copy_to(IN_DATA, bytes, size);
    give(USB_BUFFER_IN(EP_DATA), USB_FULL | sending.pid | size);
    sending.pid ^= USB_DATA1;
    sending.occupied = true;
}

static void send_packet(void) {
    uint16_t size = sending.left < PACKET ? sending.left : PACKET;
    give_packet(sending.bytes, size);
    sending.bytes += size;
    sending.left = (uint16_t)(sending.left - size);
    sending.zero_follows = sending.left == 0u && size == PACKET;
    sending.begun = true;
}

static void go_on_sending(void) {
    sending.occupied = false;
    if (sending.busy && (!sending.begun || sending.left != 0u || sending.zero_follows)) {
        send_packet();
    } else if (sending.busy) {
        sending.busy = sending.begun = false;
        hal_wake();
    }
}

/* A message that was on its way when the host went away is lost; one that had not begun waits. */
static void forget_line(void) {
    configured = sending.occupied = false;
    if (sending.begun) {
        sending.left = 0u;
        sending.busy = sending.begun = sending.zero_follows = false;
    }
    sending.pid = received.pid = 0u;
    received.size = 0u;
    hal_wake();
}

static void send_answer(void) {
    uint16_t size = control.left < PACKET ? control.left : PACKET;
    copy_to(USB_EP0_DATA, control.answer, size);
    control.answer += size;
    control.left = (uint16_t)(control.left - size);
    control.zero_follows = control.zero_follows && control.left == 0u && size == PACKET;
    give(USB_BUFFER_IN(0u), USB_FULL | control.pid | size);
    control.pid ^= USB_DATA1;
}

static void answer(const uint8_t *bytes, uint16_t size, const struct setup *setup) {
    control.answer = bytes;
    control.left = size < setup->length ? size : setup->length;
    control.zero_follows = size < setup->length;
    send_answer();
    give(USB_BUFFER_OUT(0u), USB_DATA1 | PACKET); /* the host's packet of none, at the end */
}

static void agree(void) {
    control.left = 0u;
    control.zero_follows = false;
    send_answer();
}

static void refuse(void) {
    REGISTER(USB_EP_STALL_ARM) = 3u;
    REGISTER(USB_BUFFER_IN(0u)) = USB_STALL;
    REGISTER(USB_BUFFER_OUT(0u)) = USB_STALL;
}

static void open_line(void) {
    static const uint8_t end_of_block = 0u;
    REGISTER(USB_EP_IN(EP_NOTIFY)) =
        USB_EP_ENABLE | USB_EP_INTERRUPT | USB_EP_PERIODIC | (NOTIFY_DATA - USB_MEMORY);
    REGISTER(USB_EP_IN(EP_DATA)) =
        USB_EP_ENABLE | USB_EP_INTERRUPT | USB_EP_BULK | (IN_DATA - USB_MEMORY);
    REGISTER(USB_EP_OUT(EP_DATA)) =
        USB_EP_ENABLE | USB_EP_INTERRUPT | USB_EP_BULK | (OUT_DATA - USB_MEMORY);
    forget_line();
    listen();
    configured = true;
    give_packet(&end_of_block, 1u); /* of what a host may have heard before a reset */
}

static void say_descriptor(const struct setup *setup) {
    struct descriptor found = descriptor_of(setup->value);
    if (found.size == 0u) {
        refuse();
    } else {
        answer(found.bytes, found.size, setup);
    }
}

/* Requests that are answered. */
static void tell(uint16_t request, const struct setup *setup) {
    static const uint8_t none[2];
    static uint8_t is_configured;
    switch (request) {
    case GET_STATUS:
        answer(none, 2u, setup);
        return;
    case GET_DESCRIPTOR:
        say_descriptor(setup);
        return;
    case GET_CONFIGURATION:
        is_configured = configured ? 1u : 0u;
        answer(&is_configured, 1u, setup);
        return;
    case GET_LINE_CODING:
        answer(coding, CODING_SIZE, setup);
        return;
    default:
        refuse();
    }
}

/* Requests without data; false: there is none of that kind. */
static bool obey(uint16_t request, uint8_t recipient, uint16_t value, uint16_t index) {
    switch (request) {
    case SET_ADDRESS:
        control.address = (uint8_t)value;
        return value <= MOST_ADDRESS;
    case SET_CONFIGURATION:
        if (value == 0u) {
            forget_line();
        } else if (value == 1u) {
            open_line();
        }
        return value <= 1u;
    case CLEAR_FEATURE:
        if (recipient == OF_ENDPOINT && value == ENDPOINT_HALT) {
            restart_toggles(index);
        }
        return true;
    case SET_INTERFACE:
        if (recipient == OF_INTERFACE && index == DATA_INTERFACE && value == 0u) {
            restart_toggles(EP_DATA);
            restart_toggles(EP_DATA | TO_HOST);
        }
        return value == 0u; /* neither has an alternative */
    case SET_FEATURE:
    case SET_CONTROL_LINE_STATE:
        return true;
    default:
        return false;
    }
}

static void take_request(const struct setup *setup) {
    uint16_t request = (uint16_t)((uint16_t)(setup->kind & KIND_MASK) << 8 | setup->request);
    if ((setup->kind & TO_HOST) != 0u) {
        tell(request, setup);
    } else if (request == SET_LINE_CODING && setup->length == CODING_SIZE) {
        control.takes_coding = true;
        give(USB_BUFFER_OUT(0u), USB_DATA1 | PACKET);
    } else if (setup->length == 0u && obey(request, setup->kind & RECIPIENT_MASK, setup->value, setup->index)) {
        agree();
    } else {
        control.address = 0u;
        refuse();
    }
}

static void on_setup(void) {
    struct setup setup;
    uint32_t words[2] = {REGISTER(USB_MEMORY), REGISTER(USB_MEMORY + 4u)};
    REGISTER(USB_SIE_STATUS) = USB_SETUP_CAME;
    (void)memcpy(&setup, words, sizeof setup);
    control.pid = USB_DATA1;
    control.takes_coding = false;
    control.zero_follows = false;
    control.left = 0u;
    take_request(&setup);
}

static void on_control_in(void) {
    if (control.address != 0u) {
        REGISTER(USB_ADDR) = control.address;
        control.address = 0u;
    }
    if (control.left != 0u || control.zero_follows) {
        send_answer();
    }
}

static void on_control_out(void) {
    if (!control.takes_coding) {
        return;
    }
    control.takes_coding = false;
    if ((REGISTER(USB_BUFFER_OUT(0u)) & USB_LENGTH_MASK) != CODING_SIZE) {
        refuse();
        return;
    }
    for (size_t at = 0u; at < CODING_SIZE; at++) {
        coding[at] = BYTES(USB_EP0_DATA)[at];
    }
    agree();
}

static void on_received(void) {
    uint8_t size = (uint8_t)(REGISTER(USB_BUFFER_OUT(EP_DATA)) & USB_LENGTH_MASK);
    if (size == 0u) {
        listen();
        return;
    }
    received.size = size;
    hal_wake();
}

static void on_buffers(void) {
    uint32_t done = REGISTER(USB_BUFF_STATUS);
    REGISTER(USB_BUFF_STATUS) = done;
    if ((done & BIT_IN(0u)) != 0u) {
        on_control_in();
    }
    if ((done & BIT_OUT(0u)) != 0u) {
        on_control_out();
    }
    if ((done & BIT_IN(EP_DATA)) != 0u) {
        go_on_sending();
    }
    if ((done & BIT_OUT(EP_DATA)) != 0u) {
        on_received();
    }
}

static void on_bus_reset(void) {
    REGISTER(USB_SIE_STATUS) = USB_BUS_RESET;
    REGISTER(USB_ADDR) = 0u;
    control.address = 0u;
    suspended = false;
    forget_line();
}

void on_usb(void) {
    uint32_t why = REGISTER(USB_INTS);
    if ((why & USB_ON_BUS_RESET) != 0u) {
        on_bus_reset();
    }
    if ((why & USB_ON_SUSPEND) != 0u) { /* the cable pulled, or the host asleep */
        REGISTER(USB_SIE_STATUS) = USB_SUSPENDED;
        suspended = true;
        hal_wake();
    }
    if ((why & USB_ON_RESUME) != 0u) {
        REGISTER(USB_SIE_STATUS) = USB_RESUMED;
        suspended = false;
        hal_wake();
    }
    if ((why & USB_ON_SETUP) != 0u) {
        on_setup();
    }
    if ((why & USB_ON_BUFFER) != 0u) {
        on_buffers();
    }
}

void usb_start(void) {
    clocks_unreset(RESET_USBCTRL);
    for (uint32_t at = 0u; at < USB_MEMORY_SIZE; at += 4u) {
        REGISTER(USB_MEMORY + at) = 0u;
    }
    REGISTER(USB_MUXING) = USB_TO_PHY | USB_SOFTCON;
    REGISTER(USB_PWR) = USB_VBUS_SEEN;
    REGISTER(USB_MAIN_CTRL) = USB_ENABLE;
    REGISTER(USB_SIE_CTRL) = USB_EP0_INTERRUPT;
    REGISTER(USB_INTE) =
        USB_ON_BUFFER | USB_ON_BUS_RESET | USB_ON_SETUP | USB_ON_SUSPEND | USB_ON_RESUME;
    REGISTER(USB_SIE_CTRL) = USB_EP0_INTERRUPT | USB_PULL_UP;
}

int16_t hal_uart_get(void) {
    if (received.size == 0u) {
        return -1;
    }
    uint8_t byte = BYTES(OUT_DATA)[received.next++];
    if (received.next == received.size) {
        hal_lock();
        listen();
        hal_unlock();
    }
    return byte;
}

void hal_uart_send(const uint8_t *bytes, uint16_t size) {
    hal_lock();
    sending.bytes = bytes;
    sending.left = size;
    sending.busy = true;
    REGISTER(NVIC_PENDING) = 1u << IRQ_SEND;
    hal_unlock();
}

/* The first packet, once there is a host: here, since copying it under a lock would hold up the
   scan. */
void on_send(void) {
    if (configured && sending.busy && !sending.occupied) {
        send_packet();
    }
}

bool hal_uart_busy(void) {
    return sending.busy;
}

bool hal_uart_sent(void) {
    return !sending.busy;
}

bool hal_uart_up(void) {
    return configured && !suspended;
}

bool hal_uart_can(uint32_t baud) {
    return baud >= 9600u && baud <= FIRST_BAUD; /* on USB a rate means nothing */
}

void hal_uart_set_baud(uint32_t baud) {
    (void)baud;
}
