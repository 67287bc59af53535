// libFuzzer on the board's side of the line: whatever comes, no rule of the watched machine is
// broken, memory stays sound, and the second message behind the dirt is answered.
#include "../machine.h"

#include <cstdio>
#include <cstdlib>

namespace {

constexpr uint8_t kFirst = 201, kSecond = 202;

[[noreturn]] void fail(const char *why) {
    (void)std::fprintf(stderr, "%s\n", why);
    std::abort();
}

void run_rounds(int rounds) {
    for (int k = 0; k < rounds; k++) {
        machine.ns += 50'000;
        while (machine.deliver(machine.ns)) {
        }
        board_step();
    }
}

bool is_answer(const Bytes &payload) {
    return payload.size() == SIZE_INFO && payload[0] == MSG_INFO &&
           payload[AT_INFO_REQUEST] == kSecond;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    static const Bytes first = enclose({MSG_GET_INFO, kFirst});
    static const Bytes second = enclose({MSG_GET_INFO, kSecond});
    machine.events.clear();
    machine.sent.clear();
    machine.power_on();
    machine.say_raw(Bytes(data, data + size));
    machine.say_raw(first);
    machine.say_raw(second);
    for (int k = 0; k < 100 && !machine.line.empty(); k++) {
        run_rounds(4);
    }
    run_rounds(4);
    for (const std::string &wrong : machine.wrongs) {
        fail(wrong.c_str());
    }
    for (const Bytes &payload : machine.heard()) {
        if (is_answer(payload)) {
            return 0;
        }
    }
    fail("the second message behind the dirt was not answered");
}
