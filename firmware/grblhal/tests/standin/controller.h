/* A controller to test the plugin with: it plans and executes lines as the core of grblHAL does (August 2026). Each
 * function says in controller.c which functions of the core it repeats.
 *
 * SPDX-License-Identifier: MIT
 * Copyright (c) 2026 The trueaxis maintainers
 */
#ifndef STANDIN_CONTROLLER_H
#define STANDIN_CONTROLLER_H

#include "grbl/hal.h"
#include "grbl/kinematics/interface.h"

/* A planned segment. */
struct block {
    plan_block_t plan;
    int32_t from[N_AXIS], steps[N_AXIS]; /* its start and its end */
    plan_line_data_t data;
};

/* Blocks since `controller_start`, and how many of them are executed: all but the last hundred. */
extern struct block blocks[];
extern size_t planned, executed;
/* Called before the planner takes a segment: null, or a user's action. */
extern void (*meanwhile)(size_t block);
/* Set by that action: the line ends there without a report by a later call; a reset follows. */
extern bool aborted;
/* Another plugin shows the position when the state changes. */
extern bool displays;
/* Blocks of the planner ($398). */
extern uint_fast16_t buffer_size;
/* The data of the last line, in their final state. */
extern plan_line_data_t last_data;
/* Axis positions after homing. */
extern float home_at[N_AXIS];
/* The last alarm: 2 soft limit, 4 the probe is triggered already, 5 it was not triggered; 0: none. */
extern int alarm;
/* A wall that triggers the probe: the motor of this axis is at least this far in direction `sign`; 0: there is none. */
struct wall {
    size_t axis;
    float at;
    int sign;
};
extern struct wall wall;
/* The existing file; null if there is none. */
extern const void *file_bytes;
extern size_t file_size;
/* Messages since the last `said_nothing`. */
extern char said[8192];
void said_nothing(void);

/* Starts, with kinematics set up after the plugin, or null. */
void controller_start(void (*set_up_kinematics)(void));
void set_state(sys_state_t to);
/* Time passes while the controller waits for a command. */
void wait_for(double seconds);
/* A line as with G1 (mm/min), G0 (feed 0), or as specified in `data`. Returns false if refused by the soft limits. */
bool line_to(const float *target, float feed);
bool line(const float *target, plan_line_data_t data);
/* The same as with `$J=`. */
bool jog_to(const float *target, float feed);
/* The characters 0x85 and, as that action, 0x19. */
void jog_cancel(void);
void stop(void);
/* G38.2 and G38.4, or G38.3 and G38.5, which are no error without contact. */
bool probe_to(const float *target, float feed, bool no_error);
/* Executes everything, or up to a fraction of one block; then the controller is at rest. */
void execute(void);
void execute_to(size_t block, double share);
/* Drops everything not executed, and informs planner and parser of the machine's position. */
void reset(void);
void home(uint8_t mask);
/* Shown positions, and motor positions. */
void shown(float *position);
float motor(size_t axis);
status_code_t command(const char *text);

#endif
