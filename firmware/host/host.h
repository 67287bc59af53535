/* Set-up of the process; before board_start. */
#ifndef TOMOSKIN_HOST_H
#define TOMOSKIN_HOST_H

#include <stdint.h>

/* Open the skin memory (NULL: a star of resistors) and a pty, and print the pty's path, or
   `link_path`, a link to it, if that is not NULL. `current`: of the limiter, uA. */
void host_set_up(const char *skin_path, uint32_t current, const char *link_path);

#endif
