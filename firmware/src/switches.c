#include "switches.h"

#include "hal.h"
#include "limits.h"

bool switches_set(uint8_t source, uint8_t sink, uint16_t dead_time) {
    hal_switches_disable();
    if (source == SWITCHES_OFF && sink == SWITCHES_OFF) {
        return true;
    }
    if (source == sink || source >= CHANNELS || sink >= CHANNELS) {
        return false;
    }
    hal_switches_address(source, sink);
    hal_switches_latch();
    hal_delay_us(dead_time > LEAST_DEAD_TIME_US ? dead_time : LEAST_DEAD_TIME_US);
    hal_switches_enable(source, sink);
    return true;
}
