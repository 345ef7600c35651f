/* The kinematics of the controller, with corrections around them.
 *
 * SPDX-License-Identifier: MIT
 * Copyright (c) 2026 The trueaxis maintainers
 */
#ifndef TXA_MOTION_H
#define TXA_MOTION_H

#include "controller.h"

/* Chains the entries of `kinematics` as they are now, if they are not chained. */
void txa_motion_chain(void);
/* Looks how far the planned path has been executed: as often as possible. */
void txa_motion_watch(void);
/* What is left of the motion under way is not planned any more: may be called from an interrupt. */
void txa_motion_cancel(void);
/* True while the machine stands and nothing is planned. */
bool txa_motion_at_rest(void);
/* At rest: the corrections are out from here on, and no axis has moved: the shown position changes instead. */
void txa_motion_restart(void);

#endif
