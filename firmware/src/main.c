#include "board.h"
#include "hal.h"

int main(void) {
    board_start();
    for (;;) {
        board_step();
        hal_idle();
    }
}
