/* `$TRUEAXIS…`.
 *
 * SPDX-License-Identifier: MIT
 * Copyright (c) 2026 The trueaxis maintainers
 */
#ifndef TXA_COMMANDS_H
#define TXA_COMMANDS_H

#include <stdbool.h>

/* Registers the command. */
void txa_commands(void);
/* Loads the tables, while the machine is at rest, and reports the result. */
bool txa_load_and_say(void);

#endif
