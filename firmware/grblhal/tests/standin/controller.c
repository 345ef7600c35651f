/* SPDX-License-Identifier: MIT
 * Copyright (c) 2026 The trueaxis maintainers
 */
#include "controller.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define MOST_BLOCKS 200000
/* Blocks of the planner. */
#define BUFFER 100

settings_t settings;
system_t sys;
parser_state_t gc_state;
grbl_t grbl;
grbl_hal_t hal;
kinematics_t kinematics;
vfs_events_t vfs;
static const char letters[] = "X\0Y\0Z\0A\0B\0C";
char const *const axis_letter[N_AXIS] = {
    &letters[0], &letters[2], &letters[4],
#if N_AXIS == 6
    &letters[6], &letters[8], &letters[10],
#endif
};

struct block blocks[MOST_BLOCKS];
size_t planned, executed;
void (*meanwhile)(size_t block);
bool aborted;
plan_line_data_t last_data;
float home_at[N_AXIS];
float soft_lower[N_AXIS], soft_upper[N_AXIS];
bool soft_limits;
const void *file_bytes;
size_t file_size;
char said[8192];

static sys_state_t state;
static int32_t planner_position[N_AXIS];
static foreground_task_ptr startup;
static sys_commands_t *commands;

/* Texts. */
static void say(const char *text)
{
    strncat(said, text, sizeof said - strlen(said) - 1);
}

void said_nothing(void)
{
    said[0] = '\0';
}

void report_message(const char *text, message_type_t type)
{
    say(type == Message_Warning ? "[MSG:Warning: " : "[MSG:");
    say(text);
    say("]\n");
}

void report_plugin(const char *name, const char *version)
{
    say(name);
    say(version);
}

char *ftoa(float n, uint8_t decimal_places)
{
    static char text[48];
    snprintf(text, sizeof text, "%.*f", decimal_places, (double)n);
    return text;
}

char *uitoa(uint32_t n)
{
    static char text[12];
    snprintf(text, sizeof text, "%lu", (unsigned long)n);
    return text;
}

/* Files: one. */
static vfs_file_t file;

vfs_file_t *vfs_open(const char *filename, const char *mode)
{
    file.size = file_size;
    return file_bytes != NULL && strcmp(filename, "/trueaxis.trax") == 0 && mode[0] == 'r' ? &file : NULL;
}

size_t vfs_read(void *buffer, size_t size, size_t count, vfs_file_t *from)
{
    size_t bytes = size * count < from->size ? size * count : from->size;
    memcpy(buffer, file_bytes, bytes);
    return bytes / size;
}

void vfs_close(vfs_file_t *closed)
{
    closed->size = 0;
}

/* The machine. */
sys_state_t state_get(void)
{
    return state;
}

void set_state(sys_state_t to)
{
    state = to;
}

void limits_set_machine_positions(axes_signals_t cycle, bool add_pulloff)
{
    for (size_t i = 0; i < N_AXIS; i++)
        if (cycle.mask & bit(i))
            sys.position[i] = add_pulloff ? (int32_t)lroundf(home_at[i] * settings.axis[i].steps_per_mm) : 0;
}

void system_convert_array_steps_to_mpos(float *position, int32_t *steps)
{
    kinematics.transform_steps_to_cartesian((coord_data_t *)(void *)position, (mpos_t *)(void *)steps);
}

void shown(float *position)
{
    system_convert_array_steps_to_mpos(position, sys.position);
}

float motor(size_t axis)
{
    return (float)sys.position[axis] / settings.axis[axis].steps_per_mm;
}

float *plan_get_position(void)
{
    static float position[N_AXIS];
    for (size_t i = 0; i < N_AXIS; i++)
        position[i] = (float)planner_position[i] / settings.axis[i].steps_per_mm;
    return position;
}

plan_block_t *plan_get_current_block(void)
{
    return executed < planned ? &blocks[executed].plan : NULL;
}

uint_fast16_t plan_get_buffer_size(void)
{
    return BUFFER;
}

uint_fast16_t plan_get_block_buffer_available(void)
{
    return BUFFER - (planned - executed);
}

void plan_sync_position(void)
{
    memcpy(planner_position, sys.position, sizeof planner_position);
}

static void plan(const float *target, const plan_line_data_t *data)
{
    struct block *block = &blocks[planned];
    bool moves = false;
    block->data = *data;
    for (size_t i = 0; i < N_AXIS; i++) {
        block->plan.target_mm[i] = target[i];
        block->steps[i] = (int32_t)lroundf(target[i] * settings.axis[i].steps_per_mm);
        moves = moves || block->steps[i] != planner_position[i];
    }
    if (!moves || planned + 1 == MOST_BLOCKS)
        return;
    if (planned - executed == BUFFER)
        memcpy(sys.position, blocks[executed++].steps, sizeof sys.position);
    memcpy(block->from, planner_position, sizeof block->from);
    memcpy(planner_position, block->steps, sizeof planner_position);
    planned++;
    grbl.on_execute_realtime(state);
}

/* Every target is stored where the first call said: later calls only report whether there is one. */
bool line(const float *target, plan_line_data_t data)
{
    coord_data_t to, at;
    float feed = data.feed_rate;
    memcpy(to.values, target, sizeof to.values);
    memcpy(at.values, plan_get_position(), sizeof at.values);
    data.rate_multiplier = 1.0f;
    float *segment = kinematics.segment_line(&to, &at, &data, true)->values;
    for (size_t i = 0; soft_limits && i < N_AXIS; i++)
        if (segment[i] < soft_lower[i] || segment[i] > soft_upper[i])
            return false;
    if (state == STATE_CHECK_MODE)
        return true;
    while (kinematics.segment_line((coord_data_t *)(void *)segment, NULL, &data, false) != NULL) {
        aborted = false;
        if (meanwhile != NULL)
            meanwhile(planned);
        if (aborted)
            return false;
        plan(segment, &data);
        data.feed_rate = feed;
    }
    memcpy(gc_state.position, target, sizeof gc_state.position);
    last_data = data;
    return true;
}

bool line_to(const float *target, float feed)
{
    plan_line_data_t data = {.feed_rate = feed};
    data.condition.rapid_motion = feed == 0.0f;
    return line(target, data);
}

void execute(void)
{
    if (planned > executed)
        memcpy(sys.position, blocks[planned - 1].steps, sizeof sys.position);
    executed = planned;
    state = STATE_IDLE;
    grbl.on_execute_realtime(state);
}

void execute_to(size_t block, double share)
{
    const struct block *of = &blocks[block];
    for (size_t i = 0; i < N_AXIS; i++)
        sys.position[i] = of->from[i] + (int32_t)lround(share * (of->steps[i] - of->from[i]));
    executed = block;
    state = STATE_CYCLE;
    grbl.on_execute_realtime(state);
}

void reset(void)
{
    planned = executed;
    state = STATE_IDLE;
    sync_position();
}

void home(uint8_t mask)
{
    state = STATE_HOMING;
    /* Axes that are not homed must not be asked to move; the shown position must be that of the motors. */
    coord_data_t at, to;
    system_convert_array_steps_to_mpos(at.values, sys.position);
    coord_data_t *towards = kinematics.transform_from_cartesian(&to, &at);
    for (size_t i = 0; i < N_AXIS; i++)
        if (!(mask & bit(i)))
            sys.position[i] = (int32_t)lroundf(towards->values[i] * settings.axis[i].steps_per_mm);
    kinematics.limits_set_machine_positions((axes_signals_t){.mask = mask});
    sys.homed.mask |= mask;
    sync_position();
    state = STATE_IDLE;
}

void system_register_commands(sys_commands_t *registered)
{
    commands = registered;
}

status_code_t command(const char *text)
{
    char copy[80];
    strncpy(copy, text + 1, sizeof copy - 1);
    copy[sizeof copy - 1] = '\0';
    char *argument = strchr(copy, '=');
    if (argument != NULL)
        *argument++ = '\0';
    for (size_t k = 0; k < commands->n_commands; k++)
        if (strcmp(copy, commands->commands[k].command) == 0)
            return commands->commands[k].execute(state, argument);
    return Status_Unhandled;
}

bool task_run_on_startup(foreground_task_ptr task, void *data)
{
    (void)data;
    startup = task;
    return true;
}

static void no_options(bool newopt)
{
    (void)newopt;
}

static void nothing_else(sys_state_t of)
{
    (void)of;
}

void controller_start(void (*set_up_kinematics)(void))
{
    memset(&kinematics, 0, sizeof kinematics);
    memset(&grbl, 0, sizeof grbl);
    memset(&sys, 0, sizeof sys);
    memset(&gc_state, 0, sizeof gc_state);
    memset(&vfs, 0, sizeof vfs);
    grbl.on_report_options = no_options;
    grbl.on_execute_realtime = nothing_else;
    hal.stream.write = say;
    planned = executed = 0;
    meanwhile = NULL;
    soft_limits = false;
    state = STATE_IDLE;
    said_nothing();
    memset(&settings, 0, sizeof settings);
    settings.steppers.is_rotary.mask = (uint8_t)(bit(N_AXIS) - bit(3));
    settings.flags.rotary_fix_enable = 1;
    for (size_t i = 0; i < N_AXIS; i++) {
        bool rotary = i >= 3;
        settings.axis[i].steps_per_mm = rotary ? 5000.0f : 1600.0f;
        settings.axis[i].max_rate = rotary ? 10800.0f : 30000.0f;
        settings.axis[i].acceleration = 500.0f * 3600.0f;
    }
    my_plugin_init();
    if (set_up_kinematics != NULL)
        set_up_kinematics();
    sync_position();
    if (startup != NULL)
        startup(NULL);
}
