/* tomoskin-board [-s SKIN_MEMORY] [-c MICROAMPERES] [-l LINK]: the firmware as a process. */
#include "board.h"
#include "hal.h"
#include "host.h"

#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

int main(int count, char **arguments) {
    const char *skin = NULL;
    const char *link = NULL;
    unsigned long current = 100000ul;
    for (int option; (option = getopt(count, arguments, "s:c:l:")) != -1;) {
        switch (option) {
        case 's':
            skin = optarg;
            break;
        case 'c':
            current = strtoul(optarg, NULL, 10);
            break;
        case 'l':
            link = optarg;
            break;
        default:
            (void)fprintf(stderr, "usage: %s [-s skin memory] [-c uA] [-l link]\n", arguments[0]);
            return 2;
        }
    }
    host_set_up(skin, (uint32_t)current, link);
    board_start();
    for (;;) {
        board_step();
        hal_idle();
    }
}
