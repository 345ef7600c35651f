/* SPDX-License-Identifier: MIT
 * Copyright (c) 2026 The trueaxis maintainers
 */
#include "motion.h"
#include "cartesian.h"
#include "compensation.h"
#include "pieces.h"
#include "trace.h"

#include <math.h>
#include <string.h>

/* States whose motions bypass the kinematics and go to motor positions, which must be shown then. */
#define OF_MOTORS (STATE_HOMING | STATE_SAFETY_DOOR | STATE_SLEEP)
/* A position counts as the planned one within this distance, which allows for rounding to steps and of large floats. */
#define SAME_STEPS 1.5
/* Limits of one step of the servo (trueaxis_servo_update). */
#define MOST_PERIOD 0.01
#define LEAST_PERIOD 1e-6
/* Maximum number of servo steps for a long piece: any remaining time is made up in the next pieces. */
#define MOST_STEPS 64
/* Rounds until position and correction agree: each reduces the error by the slope of the correction, at most 1e-3. */
#define ROUNDS 4

static kinematics_t inner;
static travel_limits_ptr inner_limits;
static bool inner_has_limits; /* of its own, in positions of motors */

/* End of the planned path: uncorrected command, and motor positions. */
static float command[N_AXIS], motors[N_AXIS];
static bool known;         /* the two are known */
static bool positions_set; /* by homing, since then */

/* The current motion, from `from` to `to`, in pieces. */
static float from[N_AXIS], to[N_AXIS];
static coord_data_t *within; /* targets of the inner kinematics */
static uint32_t pieces, piece;
static float feed;
static bool ours;    /* tables were in use when it began */
static volatile bool on_its_way; /* a piece was issued, and the planner may not have it yet */
static float behind[N_AXIS];     /* motor positions before that piece */
static coord_data_t out;         /* its end: grblHAL reads it when it plans the piece */
static bool by_time; /* its feed was converted to a time */
static bool jogs;    /* the current motion is a jog */
static volatile bool cancelled;
static float parsed[N_AXIS]; /* the parser's position after a jog that was cut short */
static const plan_line_data_t *probe_data; /* of the probing move that comes next */
static bool probes;                        /* the current motion probes */

static bool same(const float *a, const float *b)
{
    for (size_t i = 0; i < N_AXIS; i++)
        if (fabs((double)a[i] - (double)b[i]) * (double)settings.axis[i].steps_per_mm > SAME_STEPS)
            return false;
    return true;
}

static void corrected(float *position, const float *uncorrected)
{
    for (size_t i = 0; i < N_AXIS; i++)
        position[i] = (float)((double)uncorrected[i] + txa_correction()[i]);
}

static void uncorrected(float *position, const float *at, const double *correction)
{
    for (size_t i = 0; i < N_AXIS; i++)
        position[i] = (float)((double)at[i] - correction[i]);
}

/* The motors are at `at`, which is not the end of the planned path: after homing, a reset, a probe, a cancelled jog.
 * The corrections become those of this place, as the servo computes them, and the command becomes the one that leads
 * here: no axis moves. */
static void align(const float *at)
{
    double correction[N_AXIS];
    int8_t directions[N_AXIS] = {0};
    if (!known || positions_set)
        txa_trace_forget();
    if (positions_set)
        txa_restart();
    positions_set = false;
    bool on_path = txa_trace_find(at, correction, directions);
    uncorrected(command, at, on_path ? correction : txa_correction());
    /* The servo would take this for a move, so it is given the actual directions of the axes. */
    txa_set_travel(directions);
    for (int round = 0; round < ROUNDS && txa_status().factor > 0.0f; round++) {
        txa_settle(command);
        uncorrected(command, at, txa_correction());
    }
    /* They are out already at the end of what was planned, and at once here. */
    if (!(txa_status().factor > 0.0f))
        uncorrected(command, at, txa_correction());
    memcpy(motors, at, sizeof motors);
    known = true;
    txa_trace_begin(motors, txa_correction());
}

/* The current or earlier position of the machine, without corrections. */
static coord_data_t *position_of(coord_data_t *position, mpos_t *steps)
{
    if (!txa_present() || (state_get() & OF_MOTORS))
        return inner.transform_steps_to_cartesian(position, steps);
    float at[N_AXIS];
    double correction[N_AXIS];
    for (size_t i = 0; i < N_AXIS; i++)
        at[i] = (float)steps->values[i] / settings.axis[i].steps_per_mm;
    bool now = memcmp(steps->values, sys.position, sizeof sys.position) == 0;
    /* A jog was cancelled while grblHAL waited for room for a piece, which it still plans afterwards. It asks for the
     * position before that, when the state is still that of a jog. */
    if (now && jogs && cancelled && on_its_way && plan_get_current_block() == NULL)
        memcpy(out.values, at, sizeof out.values);
    /* While a piece is on its way to the planner nothing may be planned, and the motors are at its start: aligning
     * there would restart the motion after it, with corrections that have had no time. */
    bool begins = on_its_way && known && !positions_set && same(at, behind);
    if (now && !begins && txa_motion_at_rest() && !(known && !positions_set && same(at, motors)))
        align(at);
    if (!txa_trace_find(at, correction, NULL)) {
        /* An earlier place, such as that of the last probing. */
        if (!txa_correction_at(at, correction))
            memcpy(correction, txa_correction(), sizeof correction);
    }
    /* In whole steps, so that a command that is a whole number of steps is shown as it was given. */
    mpos_t without;
    for (size_t i = 0; i < N_AXIS; i++)
        without.values[i] = steps->values[i] - (int32_t)lround(correction[i] * (double)settings.axis[i].steps_per_mm);
    return inner.transform_steps_to_cartesian(position, &without);
}

/* Advances time along the piece; the corrections are those at its end. */
static void pass(const float *begin, const float *end, const plan_line_data_t *data)
{
    double time = txa_least_time(begin, end, data);
    double steps = ceil(time / MOST_PERIOD);
    if (!(steps > 1.0))
        steps = 1.0;
    if (steps > MOST_STEPS)
        steps = MOST_STEPS;
    double period = time / steps;
    period = period > MOST_PERIOD ? MOST_PERIOD : period < LEAST_PERIOD ? LEAST_PERIOD : period;
    for (int step = 1; step <= (int)steps; step++) {
        float at[N_AXIS];
        for (size_t i = 0; i < N_AXIS; i++)
            at[i] = step == (int)steps
                        ? end[i]
                        : (float)((double)begin[i] + ((double)end[i] - (double)begin[i]) * (double)step / steps);
        txa_advance(at, period);
    }
}

/* The next motion of the inner kinematics; false if there is none. */
static bool next(plan_line_data_t *data)
{
    if (inner.segment_line(within, NULL, data, false) == NULL)
        return false;
    memcpy(from, command, sizeof from);
    memcpy(to, within->values, sizeof to);
    feed = data->feed_rate;
    pieces = txa_acting() ? txa_pieces(from, to) : 1;
    /* grblHAL watches the probe only after the whole line is planned, and a full planner starts to move before that. */
    uint_fast16_t room = plan_get_block_buffer_available();
    if (probes && pieces > room)
        pieces = room > 1 ? (uint32_t)room : 1;
    piece = 0;
    return true;
}

static coord_data_t *begin_line(coord_data_t *target, const coord_data_t *position, plan_line_data_t *data)
{
    coord_data_t start;
    txa_take_tool_length();
    if (!known || positions_set || !same(position->values, motors))
        align(position->values);
    memcpy(start.values, command, sizeof start.values);
    pieces = piece = 0;
    within = inner.segment_line(target, &start, data, true);
    /* Soft limits check this position, which is uncorrected. */
    out = *within;
    return &out;
}

/* As in the kinematics of grblHAL, every target is stored where the first call returned. */
static coord_data_t *segment_line(coord_data_t *target, coord_data_t *position, plan_line_data_t *data, bool init)
{
    if (init) {
        by_time = cancelled = on_its_way = false;
        jogs = data->condition.jog_motion;
        ours = txa_present();
        probes = data == probe_data;
        probe_data = NULL;
    }
    if (!ours)
        return inner.segment_line(target, position, data, init);
    if (init)
        return begin_line(target, position, data);
    if (by_time)
        data->condition.inverse_time = Off;
    by_time = false;
    /* A jog cancel is a character that may come at any time: it ends nothing but a jog. */
    on_its_way = !(cancelled && jogs) && (piece < pieces || next(data));
    if (!on_its_way)
        return NULL;
    piece++;
    memcpy(behind, motors, sizeof behind);
    float begin[N_AXIS];
    double degrees;
    memcpy(begin, command, sizeof begin);
    for (size_t i = 0; i < N_AXIS; i++)
        command[i] = piece == pieces ? to[i]
                                     : (float)((double)from[i] + ((double)to[i] - (double)from[i]) * piece / pieces);
    data->feed_rate = data->condition.inverse_time ? feed * (float)pieces : feed;
    if (memcmp(begin, command, sizeof begin) != 0)
        pass(begin, command, data);
    if (txa_turns_only(begin, command, data, &degrees)) {
        /* With corrections of linear axes the planner would apply the feed to the linear axes. */
        bool inches = gc_state.modal.units_imperial && settings.flags.revert_metric_conversion;
        data->feed_rate = (float)((inches ? feed / MM_PER_INCH : feed) / degrees);
        data->condition.inverse_time = On;
        by_time = true;
    }
    corrected(motors, command);
    txa_trace_add(motors, txa_correction());
    memcpy(out.values, motors, sizeof motors);
    return &out;
}

static void set_machine_positions(axes_signals_t cycle)
{
    inner.limits_set_machine_positions(cycle);
    positions_set = true;
}

void txa_motion_chain(void)
{
    if (kinematics.segment_line != segment_line) {
        inner.segment_line = kinematics.segment_line;
        kinematics.segment_line = segment_line;
    }
    if (kinematics.transform_steps_to_cartesian != position_of) {
        inner.transform_steps_to_cartesian = kinematics.transform_steps_to_cartesian;
        kinematics.transform_steps_to_cartesian = position_of;
    }
    if (kinematics.limits_set_machine_positions != set_machine_positions) {
        inner.limits_set_machine_positions = kinematics.limits_set_machine_positions;
        kinematics.limits_set_machine_positions = set_machine_positions;
    }
}

/* At the ends of the travel an axis that is not moved may be beyond them by as much as its correction: homing another
 * axis, or other tables, change where it is shown. */
static void spare_axes_at_rest(float *target, const work_envelope_t *envelope)
{
    for (size_t k = 0; k < txa_axes(); k++) {
        size_t i;
        float most = txa_axis(k, &i)->value_bound;
        float low = envelope->min.values[i], high = envelope->max.values[i];
        bool moves = fabs((double)target[i] - (double)command[i]) * (double)settings.axis[i].steps_per_mm > SAME_STEPS;
        if (!moves && target[i] < low && target[i] >= low - most)
            target[i] = low;
        if (!moves && target[i] > high && target[i] <= high + most)
            target[i] = high;
    }
}

/* Soft limits. `mc_line` asks for what `segment_line` returned, as positions of motors, which grblHAL's own check
 * refuses: here they are uncorrected positions of axes. The corrected ones are beyond them by the bounds in the tables
 * at most. */
static bool within_travel(float *target, axes_signals_t axes, bool is_cartesian, work_envelope_t *envelope)
{
    float of_axes[N_AXIS];
    memcpy(of_axes, target, sizeof of_axes);
    if (known)
        spare_axes_at_rest(of_axes, envelope);
    return inner_limits(of_axes, axes, is_cartesian || !inner_has_limits, envelope);
}

void txa_motion_limits(bool set_up)
{
    static travel_limits_ptr core_limits;
    if (!set_up) {
        core_limits = grbl.check_travel_limits;
        return;
    }
    inner_limits = grbl.check_travel_limits;
    inner_has_limits = inner_limits != core_limits && !txa_cartesian_is(&inner);
    grbl.check_travel_limits = within_travel;
}

void txa_motion_watch(void)
{
    txa_trace_planned((uint32_t)(plan_get_buffer_size() - plan_get_block_buffer_available()));
    /* For grblHAL a jog is one block: it takes the target for its end, whatever became of pieces that waited for room,
     * and the next line would go there. */
    if (jogs && (on_its_way || cancelled) && txa_motion_at_rest() &&
        memcmp(gc_state.position, parsed, sizeof parsed) != 0) {
        gc_sync_position();
        memcpy(parsed, gc_state.position, sizeof parsed);
    }
}

void txa_motion_cancel(void)
{
    cancelled = true;
}

void txa_motion_probes(const plan_line_data_t *data)
{
    probe_data = data;
}

bool txa_motion_at_rest(void)
{
    return plan_get_current_block() == NULL && !(state_get() & (STATE_CYCLE | STATE_HOLD | STATE_JOG | OF_MOTORS));
}

void txa_motion_restart(void)
{
    known = positions_set = false;
    sync_position();
}
