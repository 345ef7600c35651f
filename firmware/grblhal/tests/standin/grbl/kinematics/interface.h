/* A stand-in for the interface of grblHAL: see hal.h.
 *
 * SPDX-License-Identifier: MIT
 * Copyright (c) 2026 The trueaxis maintainers
 */
#ifndef STANDIN_KINEMATICS_H
#define STANDIN_KINEMATICS_H

#include "../hal.h"

typedef struct {
    coord_data_t *(*transform_steps_to_cartesian)(coord_data_t *position, mpos_t *steps);
    coord_data_t *(*transform_from_cartesian)(coord_data_t *target, coord_data_t *position);
    coord_data_t *(*segment_line)(coord_data_t *target, coord_data_t *position, plan_line_data_t *pl_data, bool init);
    uint_fast8_t (*limits_get_axis_mask)(uint_fast8_t idx);
    void (*limits_set_target_pos)(uint_fast8_t idx);
    void (*limits_set_machine_positions)(axes_signals_t cycle);
} kinematics_t;
extern kinematics_t kinematics;

#endif
