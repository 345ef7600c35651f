/* SPDX-License-Identifier: MIT
 * Copyright (c) 2026 The trueaxis maintainers
 */
#include "controller.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define MOST_BLOCKS 200000

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
#if N_AXIS > 3
    &letters[6],
#endif
#if N_AXIS > 4
    &letters[8],
#endif
#if N_AXIS > 5
    &letters[10],
#endif
};

struct block blocks[MOST_BLOCKS];
size_t planned, executed;
void (*meanwhile)(size_t block);
bool aborted;
bool displays;
plan_line_data_t last_data;
float home_at[N_AXIS];
int alarm;
uint_fast16_t buffer_size = 100;
struct wall wall;
const void *file_bytes;
size_t file_size;
char said[8192];

static sys_state_t state;
static int32_t planner_position[N_AXIS];
static bool motion_cancel;
static uint32_t ticks;
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

/* machine_limits.c, limits_set_machine_positions: the switches are at `home_at`, or at 0 when homed by hand. */
void limits_set_machine_positions(axes_signals_t cycle, bool add_pulloff)
{
    for (size_t i = 0; i < N_AXIS; i++)
        if (cycle.mask & bit(i))
            sys.position[i] = add_pulloff ? (int32_t)lroundf(home_at[i] * settings.axis[i].steps_per_mm) : 0;
}

/* system.c, system_convert_array_steps_to_mpos. */
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

/* planner.c: a buffer of this size holds as many blocks. */
uint_fast16_t plan_get_buffer_size(void)
{
    return buffer_size;
}

uint_fast16_t plan_get_block_buffer_available(void)
{
    return buffer_size - (planned - executed);
}

/* planner.c, plan_sync_position: only the planner's position, not the parser's. */
void plan_sync_position(void)
{
    memcpy(planner_position, sys.position, sizeof planner_position);
}

/* planner.c, plan_buffer_line: targets in whole steps; none of them, no block. */
static bool plan(const float *target, const plan_line_data_t *data)
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
        return false;
    memcpy(block->from, planner_position, sizeof block->from);
    memcpy(planner_position, block->steps, sizeof planner_position);
    planned++;
    return true;
}

/* planner.c, plan_data_init. */
static void plan_data_init(plan_line_data_t *data)
{
    data->condition.target_validated = data->condition.target_valid = sys.soft_limits.mask == 0;
}

/* machine_limits.c, check_travel_limits: what it is asked in positions of motors, it refuses. */
static bool check_travel_limits(float *target, axes_signals_t axes, bool is_cartesian, work_envelope_t *envelope)
{
    bool failed = false;
    for (size_t i = 0; is_cartesian && i < N_AXIS; i++)
        if (sys.homed.mask & axes.mask & bit(i))
            failed = failed || target[i] < envelope->min.values[i] || target[i] > envelope->max.values[i];
    return is_cartesian && !failed;
}

/* machine_limits.c, limits_soft_check: with KINEMATICS_API it asks for positions of motors. Everything stops. */
static bool soft_check(float *target, const plan_line_data_t *data)
{
    bool ok = data->condition.target_validated
                  ? data->condition.target_valid
                  : grbl.check_travel_limits(target, sys.soft_limits, false, &sys.work_envelope);
    if (!ok) {
        alarm = 2;
        state = STATE_ALARM;
    }
    return ok;
}

/* state_machine.c, state_await_motion_cancel: the planner is emptied, planner and parser take the machine's position, and
 * only then it is no jog any more. */
static void stop_jog(void)
{
    sys_state_t of = state;
    motion_cancel = false;
    if (planned > executed)
        execute_to(executed, 0.5);
    planned = executed;
    state = of;
    sync_position();
    state = STATE_IDLE;
    float at[N_AXIS];
    if (displays)
        shown(at);
}

/* protocol.c, protocol_exec_rt_system, EXEC_STOP. */
void stop(void)
{
    stop_jog();
    aborted = true;
}

/* motion_control.c, mc_line. Every target is stored where the first call said: later calls only report whether there
 * is one. While it waits for room, a full planner starts to move (protocol.c, protocol_auto_cycle_start), and a jog may
 * be cancelled; the piece that waits is planned all the same. */
static bool mc_line(const float *target, plan_line_data_t *data)
{
    coord_data_t to, at;
    float feed = data->feed_rate;
    memcpy(to.values, target, sizeof to.values);
    memcpy(at.values, plan_get_position(), sizeof at.values);
    data->rate_multiplier = 1.0f;
    float *segment = kinematics.segment_line(&to, &at, data, true)->values;
    if (!(data->condition.target_validated && data->condition.target_valid) && !soft_check(segment, data))
        return false;
    if (state == STATE_CHECK_MODE)
        return true;
    while (kinematics.segment_line((coord_data_t *)(void *)segment, NULL, data, false) != NULL) {
        aborted = false;
        if (meanwhile != NULL)
            meanwhile(planned);
        if (aborted)
            return false;
        if (motion_cancel)
            stop_jog();
        if (planned - executed == buffer_size) {
            if (state == STATE_IDLE)
                state = STATE_CYCLE;
            memcpy(sys.position, blocks[executed++].steps, sizeof sys.position);
        }
        if (plan(segment, data))
            grbl.on_execute_realtime(state);
        if (data->condition.jog_motion && state == STATE_IDLE && planned > executed)
            state = STATE_JOG;
        data->feed_rate = feed;
    }
    data->feed_rate = feed;
    return true;
}

/* protocol.c, protocol_main_loop: at the end of each line. gcode.c, gc_execute_block, G0 and G1. */
bool line(const float *target, plan_line_data_t data)
{
    grbl.on_execute_realtime(state);
    plan_data_init(&data);
    if (!mc_line(target, &data))
        return false;
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

/* motion_control.c, mc_jog_execute; the parser's position becomes the target even if it was cancelled (gcode.c). */
bool jog_to(const float *target, float feed)
{
    plan_line_data_t data = {.feed_rate = feed};
    float to[N_AXIS];
    grbl.on_execute_realtime(state);
    memcpy(to, target, sizeof to);
    data.condition.no_feed_override = data.condition.jog_motion = data.condition.target_valid =
        data.condition.target_validated = 1;
    if (sys.soft_limits.mask && !grbl.check_travel_limits(to, sys.soft_limits, true, &sys.work_envelope))
        return false;
    mc_line(to, &data);
    memcpy(gc_state.position, to, sizeof gc_state.position);
    return true;
}

/* protocol.c, protocol_enqueue_realtime_command: plugins are told in any state, a motion is cancelled only in a jog. */
void jog_cancel(void)
{
    motion_cancel = state == STATE_JOG;
    if (grbl.on_jog_cancel != NULL)
        grbl.on_jog_cancel(state);
}

/* stepper.c, stepper_driver_interrupt_handler: while it is watched, the probe stops the block in progress, which runs
 * on for a braking distance: here the motor of this axis makes another 0.3 mm, or less at the end of the block. */
static bool touches(const struct block *block)
{
    double steps = (double)settings.axis[wall.axis].steps_per_mm, at = (double)wall.at * steps;
    double from = block->from[wall.axis], to = block->steps[wall.axis];
    if (wall.sign == 0 || (to - at) * wall.sign < 0)
        return false;
    double share = (from - at) * wall.sign >= 0 ? 0.0 : (at - from) / (to - from);
    size_t number = executed;
    execute_to(number, share);
    memcpy(sys.probe_position, sys.position, sizeof sys.probe_position);
    execute_to(number, fmin(1.0, share + 0.3 * steps / fabs(to - from)));
    return true;
}

/* motion_control.c, mc_probe_cycle, and what gcode.c does after it: the probe is watched only when the whole line is
 * planned. Afterwards the planner's position is the machine's, the parser's too if there was contact. */
bool probe_to(const float *target, float feed, bool no_error)
{
    plan_line_data_t data = {.feed_rate = feed};
    float to[N_AXIS];
    memcpy(to, target, sizeof to);
    plan_data_init(&data);
    execute();
    if (grbl.on_probe_start != NULL)
        grbl.on_probe_start((axes_signals_t){.mask = (uint8_t)(bit(N_AXIS) - 1)}, to, &data);
    if (wall.sign != 0 && (motor(wall.axis) - wall.at) * (float)wall.sign >= 0.0f) {
        alarm = 4;
        state = STATE_ALARM;
        if (grbl.on_probe_completed != NULL)
            grbl.on_probe_completed();
        return false;
    }
    if (!mc_line(to, &data))
        return false;
    sys.probing_state = Probing_Active;
    state = STATE_CYCLE;
    bool touched = false;
    while (executed < planned && !(touched = touches(&blocks[executed])))
        memcpy(sys.position, blocks[executed++].steps, sizeof sys.position);
    sys.probing_state = Probing_Off;
    state = STATE_IDLE;
    if (!touched) {
        memcpy(sys.probe_position, sys.position, sizeof sys.probe_position);
        memcpy(gc_state.position, to, sizeof gc_state.position);
        if (!no_error) {
            alarm = 5;
            state = STATE_ALARM;
        }
    }
    grbl.on_execute_realtime(state);
    planned = executed;
    plan_sync_position();
    if (grbl.on_probe_completed != NULL)
        grbl.on_probe_completed();
    if (touched)
        system_convert_array_steps_to_mpos(gc_state.position, sys.position);
    return touched;
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

/* grbllib.c, main loop after a reset: planner and parser take the machine's position. */
void reset(void)
{
    alarm = 0;
    planned = executed;
    state = STATE_IDLE;
    sync_position();
}

/* motion_control.c, mc_homing_cycle; machine_limits.c, homing_cycle: seek, pull off, locate, pull off. Each of these
 * motions bypasses `mc_line`: it goes to the shown positions, and homed axes begin at 0. */
void home(uint8_t mask)
{
    state = STATE_HOMING;
    for (int approach = 0; approach < 4; approach++) {
        coord_data_t at, to;
        system_convert_array_steps_to_mpos(at.values, sys.position);
        for (uint_fast8_t i = 0; i < N_AXIS; i++)
            if (mask & bit(i)) {
                kinematics.limits_set_target_pos(i);
                at.values[i] = approach % 2 ? -1.0f : 1.0f;
            }
        coord_data_t *towards = kinematics.transform_from_cartesian(&to, &at);
        /* Axes that are not homed must not be asked to move: the shown position must be that of the motors. */
        for (size_t i = 0; i < N_AXIS; i++)
            sys.position[i] = (int32_t)lroundf(towards->values[i] * settings.axis[i].steps_per_mm);
    }
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

static uint32_t elapsed_ticks(void)
{
    return ticks;
}

/* protocol.c, protocol_main_loop. */
void wait_for(double seconds)
{
    for (int looks = 0; looks < 100.0 * seconds; looks++) {
        ticks += 10;
        grbl.on_execute_realtime(state);
    }
}

static void nothing_else(sys_state_t of)
{
    (void)of;
}

/* grbllib.c, grbl_enter: the core's own entries, plugins, kinematics of the build, tasks. */
void controller_start(void (*set_up_kinematics)(void))
{
    memset(&grbl, 0, sizeof grbl);
    memset(&sys, 0, sizeof sys);
    memset(&gc_state, 0, sizeof gc_state);
    memset(&vfs, 0, sizeof vfs);
    grbl.on_report_options = no_options;
    grbl.on_execute_realtime = nothing_else;
    grbl.check_travel_limits = check_travel_limits;
    hal.stream.write = say;
    hal.get_elapsed_ticks = elapsed_ticks;
    ticks = UINT32_MAX - 20000; /* it wraps around after 20 s */
    planned = executed = 0;
    meanwhile = NULL;
    motion_cancel = displays = false;
    alarm = 0;
    wall.sign = 0;
    state = STATE_IDLE;
    said_nothing();
    memset(&kinematics, 0, sizeof kinematics);
    my_plugin_init();
    memset(&settings, 0, sizeof settings);
#if N_AXIS > 3
    settings.steppers.is_rotary.mask = (uint8_t)(bit(N_AXIS) - bit(3));
#endif
    settings.flags.rotary_fix_enable = 1;
    for (size_t i = 0; i < N_AXIS; i++) {
        bool rotary = i >= 3;
        settings.axis[i].steps_per_mm = rotary ? 5000.0f : 1600.0f;
        settings.axis[i].max_rate = rotary ? 10800.0f : 30000.0f;
        settings.axis[i].acceleration = 500.0f * 3600.0f;
    }
    if (set_up_kinematics != NULL)
        set_up_kinematics();
    sync_position();
    if (startup != NULL)
        startup(NULL);
}
