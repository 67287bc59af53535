// libFuzzer on the Pico's USB part before a simulated controller: whatever a host does, packets stay
// within their size and order, no answer is longer than was asked for, memory stays sound, and after
// a reset a plain host finds the device, is heard by it and hears it.
#include "../pico/registers.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <vector>

extern "C" {
#include "../../pico/descriptors.h"
#include "../../pico/rp2040.h"
#include "../../pico/usb.h"
#include "../../src/hal.h"
void on_usb(void);
void on_send(void);
}

namespace {

using Bytes = std::vector<uint8_t>;

[[noreturn]] void fail(const char *why) {
    (void)std::fprintf(stderr, "%s\n", why);
    std::abort();
}

std::array<uint8_t, USB_MEMORY_SIZE> memory;
std::array<uint8_t, 0x100> registers;
uint32_t pending;

uint32_t get(uint32_t address) { return REGISTER(address); }

void interrupt(uint32_t why) {
    REGISTER(USB_INTS) = why;
    on_usb();
    REGISTER(USB_SIE_STATUS) = REGISTER(USB_BUFF_STATUS) = 0u;  // written to be cleared
    if ((pending & (1u << IRQ_SEND)) != 0u) {
        pending = 0u;
        on_send();
    }
}

struct Host {
    int out_toggle = -1;          // of its next packet to the serial line; -1: not known
    int in_toggle = -1;           // of the next one from there
    int left = 0x10000;           // of the answer that it asked for
    Bytes line;                   // from the device's serial line
    size_t newest = 0;            // bytes in its newest packet

    void reset() {
        REGISTER(USB_SIE_STATUS) = USB_BUS_RESET;
        interrupt(USB_ON_BUS_RESET);
        if (get(USB_ADDR) != 0u) {
            fail("an address after a reset");
        }
        left = 0x10000;
        in_toggle = out_toggle = -1;
    }

    void setup(const uint8_t *bytes) {
        std::memcpy(memory.data(), bytes, 8);
        left = (bytes[0] & 0x80) != 0 ? bytes[6] | bytes[7] << 8 : 0;
        REGISTER(USB_EP_STALL_ARM) = 0u;
        REGISTER(USB_BUFFER_IN(0u)) = REGISTER(USB_BUFFER_OUT(0u)) = 0u;
        REGISTER(USB_SIE_STATUS) = USB_SETUP_CAME;
        interrupt(USB_ON_SETUP);
        note_toggles(bytes);
    }

    // What a host knows of either toggle once it has made a request without data.
    void note_toggles(const uint8_t *bytes) {
        int kind = bytes[0], request = bytes[1], value = bytes[2] | bytes[3] << 8;
        int index = bytes[4] | bytes[5] << 8, length = bytes[6] | bytes[7] << 8;
        if ((kind & 0xE0) != 0 || length != 0) {
            return;
        }
        if (request == 9) {  // SET_CONFIGURATION
            in_toggle = out_toggle = value == 1 ? 0 : -1;
        } else if (request == 1 && kind == 2 && value == 0) {  // CLEAR_FEATURE: the halt
            in_toggle = index == (EP_DATA | 0x80) ? 0 : in_toggle;
            out_toggle = index == EP_DATA ? 0 : out_toggle;
        } else if (request == 11 && kind == 1 && value == 0 && index == DATA_INTERFACE) {
            in_toggle = out_toggle = 0;  // SET_INTERFACE
        }
    }

    // What the device has ready on an endpoint; false where there is nothing.
    bool take(uint32_t endpoint, Bytes &bytes) {
        uint32_t at = USB_BUFFER_IN(endpoint);
        uint32_t control = get(at);
        if ((control & USB_AVAILABLE) == 0u) {
            return false;
        }
        uint32_t size = control & USB_LENGTH_MASK;
        if (size > PACKET || (control & USB_FULL) == 0u) {
            fail("a packet that is none");
        }
        uint32_t data = endpoint == 0u ? USB_EP0_DATA : USB_MEMORY + (get(USB_EP_IN(endpoint)) & 0xFFC0u);
        bytes.assign(simulated(data, size), simulated(data, size) + size);
        if (endpoint == EP_DATA) {
            check_turn(in_toggle, control);
        }
        REGISTER(at) = control & ~USB_AVAILABLE;
        REGISTER(USB_BUFF_STATUS) = 1u << (2u * endpoint);
        interrupt(USB_ON_BUFFER);
        return true;
    }

    static void check_turn(int &toggle, uint32_t control) {
        int now = (control & USB_DATA1) != 0u;
        if (toggle >= 0 && now != toggle) {
            fail("a packet twice or out of turn");
        }
        toggle = toggle < 0 ? -1 : !now;
    }

    bool give(uint32_t endpoint, const uint8_t *bytes, uint32_t size) {
        uint32_t at = USB_BUFFER_OUT(endpoint);
        uint32_t control = get(at);
        if ((control & USB_AVAILABLE) == 0u) {
            return false;
        }
        if (endpoint == EP_DATA) {
            check_turn(out_toggle, control);
        }
        uint32_t data = endpoint == 0u ? USB_EP0_DATA : USB_MEMORY + (get(USB_EP_OUT(endpoint)) & 0xFFC0u);
        std::copy(bytes, bytes + size, simulated(data, PACKET));
        REGISTER(at) = (control & ~(USB_AVAILABLE | USB_LENGTH_MASK)) | USB_FULL | size;
        REGISTER(USB_BUFF_STATUS) = 2u << (2u * endpoint);
        interrupt(USB_ON_BUFFER);
        return true;
    }

    // A packet of endpoint 0: of an answer no more than was asked for.
    void take_answer() {
        Bytes bytes;
        if (take(0u, bytes)) {
            left -= static_cast<int>(bytes.size());
            if (left < 0) {
                fail("an answer longer than was asked for");
            }
        }
    }

    void take_line() {
        Bytes bytes;
        if (take(EP_DATA, bytes)) {
            line.insert(line.end(), bytes.begin(), bytes.end());
            newest = bytes.size();
        }
    }

    // One request of a host that means well; what is answered.
    Bytes ask(std::array<uint8_t, 8> request) {
        setup(request.data());
        Bytes answer, packet;
        bool reads = (request[0] & 0x80u) != 0u;
        do {
            if (!take(0u, packet)) {
                fail("a plain request is not answered");
            }
            answer.insert(answer.end(), packet.begin(), packet.end());
        } while (reads && packet.size() == PACKET && answer.size() < (request[6] | request[7] << 8));
        if (reads && !give(0u, nullptr, 0u)) {
            fail("the end of a plain request is not taken");
        }
        return answer;
    }
};

constexpr std::array<uint8_t, 8> CLEAR_IN = {2, 1, 0, 0, EP_DATA | 0x80u, 0, 0, 0};
constexpr std::array<uint8_t, 8> CLEAR_OUT = {2, 1, 0, 0, EP_DATA, 0, 0, 0};

Bytes heard;  // by the firmware

void hear() {
    for (int16_t byte; (byte = hal_uart_get()) >= 0;) {
        heard.push_back(static_cast<uint8_t>(byte));
    }
}

std::array<uint8_t, 700> message;

void say(uint16_t size) {
    hal_uart_send(message.data(), size);
    if ((pending & (1u << IRQ_SEND)) != 0u) {
        pending = 0u;
        on_send();
    }
}

void check_device(Host &host) {
    host.reset();
    if (host.ask({0x80, 6, 0, 1, 0, 0, 18, 0}).size() != 18 ||
        host.ask({0x80, 6, 0, 2, 0, 0, 255, 0}).size() != 75) {
        fail("not the descriptors");
    }
    (void)host.ask({0, 5, 9, 0, 0, 0, 0, 0});
    if (get(USB_ADDR) != 9u) {
        fail("not the address that it was given");
    }
    (void)host.ask({0, 9, 1, 0, 0, 0, 0, 0});
    REGISTER(USB_SIE_STATUS) = USB_SUSPENDED;
    interrupt(USB_ON_SUSPEND);
    if (hal_uart_up()) {
        fail("a line though the host is asleep");
    }
    REGISTER(USB_SIE_STATUS) = USB_RESUMED;
    interrupt(USB_ON_RESUME);
    if (!hal_uart_up()) {
        fail("no line after a plain start");
    }
    host.take_line();  // what ends an old block
    for (int k = 0; hal_uart_busy() && k < 20; k++) {
        host.take_line();  // a message that had not begun has waited
    }
    for (uint16_t size : {130, 128}) {
        host.line.clear();
        if (size == 130) {
            (void)host.ask(CLEAR_IN);
        }
        say(size);
        if (size == 128) {
            (void)host.ask(CLEAR_IN);  // while a packet waits
        }
        for (int k = 0; k < 4; k++) {
            host.take_line();
        }
        if (hal_uart_busy() || host.line != Bytes(message.begin(), message.begin() + size)) {
            fail("the host does not hear what was said");
        }
        if (host.newest == PACKET) {
            fail("the host does not see where a message ends");
        }
    }
    for (uint32_t size : {9u, PACKET, 0u, 5u}) {
        heard.clear();
        if (size == 5u) {
            (void)host.ask(CLEAR_OUT);
        }
        if (!host.give(EP_DATA, message.data(), size)) {
            fail("the device does not listen");
        }
        if (size == PACKET) {
            (void)host.ask(CLEAR_OUT);  // while a packet has not been heard
        }
        hear();
        if (heard != Bytes(message.begin(), message.begin() + size)) {
            fail("the device does not hear what was said");
        }
    }
}

}  // namespace

extern "C" {

uint8_t *simulated(uint32_t address, uint32_t size) {
    if (address >= USB_MEMORY && address + size <= USB_MEMORY + USB_MEMORY_SIZE) {
        return memory.data() + (address - USB_MEMORY);
    }
    if (address >= USB_ADDR && address + size <= USB_ADDR + registers.size()) {
        return registers.data() + (address - USB_ADDR);
    }
    if (address == NVIC_PENDING) {
        return reinterpret_cast<uint8_t *>(&pending);
    }
    fail("no such register");
}

void clocks_unreset(uint32_t) {}
void flash_unique_id(uint8_t *id) { std::memcpy(id, "fuzzfuzz", 8); }
void hal_lock(void) {}
void hal_unlock(void) {}
void hal_wake(void) {}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    for (size_t k = 0; k < message.size(); k++) {
        message[k] = static_cast<uint8_t>(k + 1u);
    }
    const uint8_t *end = data + size;
    auto next = [&]() -> uint8_t { return data < end ? *data++ : 0u; };
    Host host;
    usb_start();
    check_device(host);
    while (data < end) {
        uint8_t action = next();
        uint8_t packet[PACKET];
        uint32_t some = 0u;
        switch (action % 12u) {
        case 0:
        case 1: {
            uint8_t request[8];
            for (uint8_t &byte : request) {
                byte = next();
            }
            host.setup(request);
            break;
        }
        case 2: host.take_answer(); break;
        case 3:
        case 4:
            for (some = next() % (PACKET + 1u); some != 0u && data < end; some--) {
                packet[PACKET - some] = next();
            }
            (void)host.give(action % 12u == 3u ? 0u : EP_DATA, packet, next() % (PACKET + 1u));
            break;
        case 5: host.take_line(); break;
        case 6: host.reset(); break;
        case 7:
            REGISTER(USB_SIE_STATUS) = USB_SUSPENDED;
            interrupt(USB_ON_SUSPEND);
            break;
        case 8:
            REGISTER(USB_SIE_STATUS) = USB_RESUMED;
            interrupt(USB_ON_RESUME);
            break;
        case 9: hear(); break;
        case 10:
            if (!hal_uart_busy()) {
                say(static_cast<uint16_t>(next() * 700u / 256u + 1u));
            }
            break;
        default: (void)hal_uart_get(); break;
        }
    }
    check_device(host);
    return 0;
}
}
