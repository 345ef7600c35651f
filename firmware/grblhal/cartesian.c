/* SPDX-License-Identifier: MIT
 * Copyright (c) 2026 The trueaxis maintainers
 */
#include "cartesian.h"

#include <string.h>

static coord_data_t *from_steps(coord_data_t *position, mpos_t *steps)
{
    for (size_t i = 0; i < N_AXIS; i++)
        position->values[i] = (float)steps->values[i] / settings.axis[i].steps_per_mm;
    return position;
}

static coord_data_t *from_cartesian(coord_data_t *target, coord_data_t *position)
{
    return memcpy(target, position, sizeof *target);
}

static coord_data_t *segment_line(coord_data_t *target, coord_data_t *position, plan_line_data_t *data, bool init)
{
    static coord_data_t only;
    static bool left;
    (void)position;
    (void)data;
    if (init)
        only = *target;
    else if (!left)
        return NULL;
    left = init;
    return &only;
}

static uint_fast8_t axis_mask(uint_fast8_t axis)
{
    return (uint_fast8_t)bit(axis);
}

static void set_target_position(uint_fast8_t axis)
{
    sys.position[axis] = 0;
}

static void set_machine_positions(axes_signals_t cycle)
{
    /* When homed by hand there is no pull-off distance, as without these entries. */
    limits_set_machine_positions(cycle, state_get() == STATE_HOMING);
}

void txa_cartesian(kinematics_t *entries)
{
    if (entries->transform_steps_to_cartesian == NULL)
        entries->transform_steps_to_cartesian = from_steps;
    if (entries->transform_from_cartesian == NULL)
        entries->transform_from_cartesian = from_cartesian;
    if (entries->segment_line == NULL)
        entries->segment_line = segment_line;
    if (entries->limits_get_axis_mask == NULL)
        entries->limits_get_axis_mask = axis_mask;
    if (entries->limits_set_target_pos == NULL)
        entries->limits_set_target_pos = set_target_position;
    if (entries->limits_set_machine_positions == NULL)
        entries->limits_set_machine_positions = set_machine_positions;
}

bool txa_cartesian_is(const kinematics_t *entries)
{
    return entries->segment_line == segment_line;
}
