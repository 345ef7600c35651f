/* Kinematics of a machine with one motor per axis, for the entries that are not filled otherwise.
 *
 * SPDX-License-Identifier: MIT
 * Copyright (c) 2026 The trueaxis maintainers
 */
#ifndef TXA_CARTESIAN_H
#define TXA_CARTESIAN_H

#include "controller.h"

/* Fills the null entries that grblHAL calls without checking. */
void txa_cartesian(kinematics_t *entries);
/* True if lines go where they are commanded. */
bool txa_cartesian_is(const kinematics_t *entries);

#endif
