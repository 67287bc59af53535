/* The board: what it does between interrupts. */
#ifndef TOMOSKIN_BOARD_H
#define TOMOSKIN_BOARD_H

void board_start(void);

/* One round: receive, obey, watch over scan and host, send. Never waits. */
void board_step(void);

#endif
