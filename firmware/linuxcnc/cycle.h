/* SPDX-License-Identifier: MIT
 *
 * One period of the real-time thread, without HAL: from positions of joints to corrections of joints.
 */
#ifndef CYCLE_H
#define CYCLE_H

#include "loading.h"

/* Values of the pin `state`: why the corrections are not in, or that they are. The first that holds. */
enum reason {
    STATE_ACTIVE = 0,
    STATE_DISABLED = 1,
    STATE_DRY_RUN = 2,
    STATE_NOT_HOMED = 3,
    STATE_HOMING = 4,
    STATE_FAULT = 5,
    STATE_FADING = 6,
    STATE_LOADING = 7
};

/* Values read from the pins and values written to them. Machine units. */
struct cycle {
    double position[MOST_JOINTS];
    bool homed[MOST_JOINTS], homing[MOST_JOINTS];
    bool on, dry;
    double length;
    double kelvin[TRUEAXIS_AUXILIARIES];
    double wanted[TRUEAXIS_ADJUSTABLE];

    double corrections[MOST_JOINTS]; /* kept from period to period */
    int shown;                       /* the joint to which the two next values belong in this period */
    double would_be;
    double share;
    float in;                        /* the fade factor */
    bool cut_off;
    bool beyond;                     /* a temperature is outside of what was measured */
    unsigned taken;                  /* number of files */
    enum reason why;
    int awaited;                     /* the joint that is not homed or is homing, or -1 */
    enum trouble of_file;            /* why the last file was not accepted */
};

/* State of the real-time thread. */
static trueaxis_servo_memory servo_memory;
static trueaxis_servo *servo;
static struct place *current;
static enum trouble refused;
static double weight_set[TRUEAXIS_ADJUSTABLE];
static bool told_on, told_dry;
static bool retiring; /* earlier tables are still being read, or were not taken back */

/* Corrections are out and are not requested. */
static bool idle(const struct cycle *c)
{
    if (c->on || c->in > 0)
        return false;
    for (int j = 0; j < configured.joints; j++)
        if (c->corrections[j] != 0)
            return false;
    return true;
}

/* Starts with the first tables, or with any others. */
static trueaxis_result begin_with(struct place *next)
{
    trueaxis_result result;
    if (servo != NULL)
        trueaxis_servo_release(servo);
    servo = NULL;
    current = NULL;
    loading_free_all_but(next);
    result = trueaxis_servo_new(&servo_memory, sizeof servo_memory, next->tables, &servo);
    if (result != TRUEAXIS_RESULT_OK)
        servo = NULL;
    told_on = told_dry = false;
    return result;
}

/* Adopts loaded tables as soon as possible. With the same axes and inputs the servo stays, and with it the lags of its
 * temperatures, whether corrections are in or not. */
static void take_offered(struct cycle *c)
{
    struct place *next = loading_offered();
    trueaxis_result result;
    bool fade = servo != NULL;
    if (next == NULL)
        return;
    result = fade ? trueaxis_servo_swap(servo, next->tables, NULL) : begin_with(next);
    if (result == TRUEAXIS_RESULT_BUSY)
        return;
    if (fade && result != TRUEAXIS_RESULT_OK && idle(c)) {
        fade = false;
        result = begin_with(next);
    }
    if (result == TRUEAXIS_RESULT_OK) {
        refused = TROUBLE_NONE;
        retiring = fade;
        current = next;
        c->taken++;
        for (int w = 0; w < TRUEAXIS_ADJUSTABLE; w++)
            weight_set[w] = NAN;
    } else {
        refused = fade ? TROUBLE_ACTIVE : TROUBLE_LIBRARY;
        SET(next->in_use, 0);
    }
    loading_take();
}

/* Returns tables that are no longer read. */
static void give_back(void)
{
    trueaxis_tables *retired;
    if (!retiring || trueaxis_servo_take_retired(servo, &retired) != TRUEAXIS_RESULT_OK || retired == NULL)
        return;
    retiring = false;
    loading_free_all_but(current);
}

/* Sets the inputs other than positions; returns the first problem. */
static enum trouble set_inputs(const struct cycle *c)
{
    enum trouble found = TROUBLE_NONE;
    for (int a = 0; a < current->auxiliaries; a++) {
        int pin = current->pin_of[a];
        double value = pin < 0 ? c->length * configured.mm : c->kelvin[pin];
        trueaxis_servo_set_auxiliary(servo, (size_t)a, value);
        if (current->needed[a] && !isfinite(value) && found == TROUBLE_NONE)
            found = pin < 0 ? TROUBLE_TOOL_LENGTH : TROUBLE_TEMPERATURE;
    }
    for (int w = 0; w < current->terms && w < configured.weights; w++) {
        if (isnan(c->wanted[w]) || c->wanted[w] == weight_set[w])
            continue;
        if (trueaxis_servo_set_weight(servo, current->term[w], c->wanted[w]) == TRUEAXIS_RESULT_OK)
            weight_set[w] = c->wanted[w];
        else if (found == TROUBLE_NONE)
            found = TROUBLE_WEIGHT;
    }
    return found;
}

/* Values for display only: one joint per period, in turn. */
static void show(struct cycle *c, const double *computed)
{
    int k;
    c->shown = c->shown + 1 < configured.joints ? c->shown + 1 : 0;
    k = current->axis_of[c->shown];
    c->would_be = k < 0 ? 0 : computed[k] * current->per_unit[k];
    c->share = k < 0 ? 0 : fabs(computed[k]) * current->per_bound[k];
}

/* Switches of the servo, which rarely change. A correction that depends on no axis stays in without a reference. */
static void set_switches(const struct cycle *c)
{
    bool on = c->on && c->awaited < 0;
    if (told_on != on)
        trueaxis_servo_enable(servo, told_on = on);
    if (told_dry != c->dry)
        trueaxis_servo_dry_run(servo, told_dry = c->dry);
}

/* Computes new corrections from the positions; returns a problem, if any. */
static enum trouble update(struct cycle *c, double period)
{
    double commands[TRUEAXIS_AXES], corrections[TRUEAXIS_AXES], computed[TRUEAXIS_AXES];
    uint32_t referenced = (1u << current->axes) - 1u;
    size_t axes = (size_t)current->axes;
    trueaxis_status status;
    trueaxis_result result;
    enum trouble found = set_inputs(c);
    /* From the last joint to the first: if an axis has several joints, the position of the first one counts. */
    for (int j = configured.joints - 1; j >= 0; j--) {
        int k = current->axis_of[j];
        if (k < 0)
            continue;
        commands[k] = c->position[j] * current->unit[k];
        /* No corrections while any joint is not homed: a switch must be found at its real place. */
        if (!c->homed[j] || c->homing[j]) {
            referenced = 0;
            c->awaited = j;
        }
        if (!isfinite(commands[k]))
            found = TROUBLE_POSITION;
    }
    set_switches(c);
    result = trueaxis_servo_update(servo, commands, axes, referenced, period, corrections);
    if (result == TRUEAXIS_RESULT_OK)
        result = trueaxis_servo_computed(servo, computed, axes);
    if (result == TRUEAXIS_RESULT_OK)
        result = trueaxis_servo_status(servo, &status);
    /* To avoid a step, the corrections stay unchanged. */
    if (result != TRUEAXIS_RESULT_OK)
        return TROUBLE_LIBRARY;
    for (int j = 0; j < configured.joints; j++)
        if (current->axis_of[j] >= 0)
            c->corrections[j] = corrections[current->axis_of[j]] * current->per_unit[current->axis_of[j]];
    show(c, computed);
    c->in = status.factor;
    c->cut_off = status.saturated != 0;
    c->beyond = (status.conditions & TRUEAXIS_BEYOND_RANGE) != 0;
    if (found == TROUBLE_NONE && (status.conditions & TRUEAXIS_BAD_PERIOD))
        found = TROUBLE_PERIOD;
    if (found == TROUBLE_NONE && (status.conditions & TRUEAXIS_BAD_INPUT))
        found = TROUBLE_REACH;
    return found;
}

/* Why the corrections are not in; what an operator decided comes before what the machine lacks. */
static enum reason state_of(const struct cycle *c, enum trouble found)
{
    if (servo == NULL)
        return found == TROUBLE_NONE ? STATE_LOADING : STATE_FAULT;
    if (!c->on)
        return STATE_DISABLED;
    if (c->dry)
        return STATE_DRY_RUN;
    if (c->awaited >= 0)
        return c->homing[c->awaited] ? STATE_HOMING : STATE_NOT_HOMED;
    /* With a fault of a file the previous one stays in use: that is active, and `fault` says the rest. */
    if (c->in >= 1)
        return STATE_ACTIVE;
    return found == TROUBLE_NONE ? STATE_FADING : STATE_FAULT;
}

/* One period, s. */
static enum trouble run_cycle(struct cycle *c, double period)
{
    enum trouble found = TROUBLE_NONE;
    c->awaited = -1;
    take_offered(c);
    give_back();
    if (servo != NULL)
        found = update(c, period);
    c->of_file = loading_trouble();
    if (c->of_file == TROUBLE_NONE)
        c->of_file = refused;
    if (found == TROUBLE_NONE)
        found = c->of_file;
    c->why = state_of(c, found);
    return found;
}

#endif
