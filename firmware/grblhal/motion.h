/* The kinematics of the controller, wrapped with corrections.
 *
 * SPDX-License-Identifier: MIT
 * Copyright (c) 2026 The trueaxis maintainers
 */
#ifndef TXA_MOTION_H
#define TXA_MOTION_H

#include "controller.h"

/* Wraps the current entries of `kinematics`, unless they are already wrapped. */
void txa_motion_chain(void);
/* Soft limits: before the kinematics of the build have been set up, and after that. */
void txa_motion_limits(bool set_up);
/* Checks how far the planned path has been executed; call it as often as possible. */
void txa_motion_watch(void);
/* Drops the unplanned rest of the current jog; may be called from an interrupt. */
void txa_motion_cancel(void);
/* The next line with these data is a probing move; null: no longer. */
void txa_motion_probes(const plan_line_data_t *data);
/* True while the machine is at rest and nothing is planned. */
bool txa_motion_at_rest(void);
/* At rest: removes the corrections without moving any axis; the shown position changes instead. */
void txa_motion_restart(void);

#endif
