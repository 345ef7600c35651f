/* SPDX-License-Identifier: MIT
 * Copyright (c) 2026 The trueaxis maintainers
 */
#include "compensation.h"
#include "blob.h"
#include "trueaxis_grblhal.h"

#include <math.h>
#include <string.h>

/* Number of 10 ms steps at one place after which every transition has ended: a cross-fade of large corrections takes
 * several seconds. */
#define MOST_STEPS 500
/* How often the clock is looked at, ms. */
#define LOOK_EVERY 100
/* Conditions that are reported when they begin. */
#define REPORTED \
    (TRUEAXIS_BAD_INPUT | TRUEAXIS_BAD_PERIOD | TRUEAXIS_BAD_AUXILIARY | TRUEAXIS_UNREFERENCED | TRUEAXIS_BEYOND_RANGE)

static trueaxis_tables_memory tables_memory;
static trueaxis_servo_memory servo_memory;
static trueaxis_tables *tables;
static trueaxis_servo *servo; /* null: nothing in use */
static char why[160] = "not loaded yet";

static size_t axes;
static trueaxis_axis axis[TRUEAXIS_AXES];
static size_t place[TRUEAXIS_AXES];
static size_t auxiliaries;
static trueaxis_auxiliary auxiliary[TRUEAXIS_AUXILIARIES];
static double auxiliary_value[TRUEAXIS_AUXILIARIES];

static txa_mode mode = TRUEAXIS_ON_AT_START ? TXA_ON : TXA_OFF;
static float length_without_g43 = NAN;
static double correction[N_AXIS];
static uint16_t faults;
static double ahead;      /* by how much planned motions are ahead of the clock, s */
static uint32_t watched;  /* the clock when it was last looked at, ms */

bool txa_present(void)
{
    return servo != NULL;
}

const char *txa_why(void)
{
    return why;
}

static bool refuse(const char *reason)
{
    strncpy(why, reason, sizeof why - 1);
    return false;
}

static bool refuse_axis(char name, const char *reason)
{
    char text[100] = "axis  ";
    text[5] = name;
    strncat(text, reason, sizeof text - strlen(text) - 1);
    return refuse(text);
}

/* Finds the controller's axes for those of the tables. */
static bool find_axes(void)
{
    trueaxis_facts facts;
    if (trueaxis_tables_facts(tables, &facts) != TRUEAXIS_RESULT_OK)
        return refuse("no facts");
    axes = facts.axes;
    auxiliaries = facts.auxiliaries;
    for (size_t k = 0; k < axes; k++) {
        trueaxis_tables_axis(tables, k, &axis[k]);
        place[k] = N_AXIS;
        for (size_t i = 0; i < N_AXIS; i++)
            if (axis_letter[i][0] == axis[k].name)
                place[k] = i;
        if (place[k] == N_AXIS)
            return refuse_axis(axis[k].name, ": the controller has none");
        bool rotary = TXA_IS_ROTARY(place[k]);
        if (rotary && axis[k].unit == TRUEAXIS_MM)
            return refuse_axis(axis[k].name, ": mm in the tables, degrees in the controller ($376)");
        if (!rotary && axis[k].unit == TRUEAXIS_DEGREES)
            return refuse_axis(axis[k].name, ": degrees in the tables, mm in the controller ($376)");
        if (kinematics.limits_get_axis_mask(place[k]) != bit(place[k]))
            return refuse_axis(axis[k].name, ": the kinematics move it with more than its motor");
    }
    for (size_t k = 0; k < auxiliaries; k++) {
        trueaxis_tables_auxiliary(tables, k, &auxiliary[k]);
        auxiliary_value[k] = NAN;
    }
    return true;
}

static void take_mode(void)
{
    trueaxis_servo_enable(servo, mode != TXA_OFF);
    trueaxis_servo_dry_run(servo, mode == TXA_DRY);
}

void txa_restart(void)
{
    trueaxis_servo_restart(servo);
    memset(correction, 0, sizeof correction);
    faults = 0;
}

static void begin(void)
{
    faults = 0;
    ahead = 0.0;
    watched = hal.get_elapsed_ticks();
    if (trueaxis_servo_new(&servo_memory, sizeof servo_memory, tables, &servo) != TRUEAXIS_RESULT_OK) {
        servo = NULL;
        refuse("no memory for a servo");
        return;
    }
    take_mode();
}

bool txa_load(void)
{
    size_t length = 0;
    const char *missing = "";
    if (servo != NULL)
        trueaxis_servo_release(servo);
    servo = NULL;
    memset(correction, 0, sizeof correction);
    if (tables == NULL) {
        trueaxis_result result = trueaxis_tables_new(TRUEAXIS_HEADER, &tables_memory, sizeof tables_memory, &tables);
        if (result != TRUEAXIS_RESULT_OK)
            return refuse(trueaxis_result_text(result));
    }
    const void *bytes = txa_blob(&length, &missing);
    if (bytes == NULL)
        return refuse(missing);
    if (trueaxis_tables_load_slot(tables, bytes, length) != TRUEAXIS_RESULT_OK) {
        trueaxis_tables_reason(tables, why, sizeof why);
        return false;
    }
    if (!find_axes())
        return false;
    if (plan_get_buffer_size() >= TRUEAXIS_TRACE)
        return refuse("the planner has as many blocks ($398) as TRUEAXIS_TRACE");
    begin();
    return servo != NULL;
}

void txa_set_mode(txa_mode to)
{
    mode = to;
    if (servo != NULL)
        take_mode();
}

txa_mode txa_get_mode(void)
{
    return mode;
}

void txa_set_length_without_g43(float length)
{
    length_without_g43 = length;
}

static void set_auxiliary(size_t number, double value)
{
    /* An input that was never set stays so: a fault if a correction depends on it; it never counts as 0. */
    if (isnan(value) && isnan(auxiliary_value[number]))
        return;
    auxiliary_value[number] = value;
    trueaxis_servo_set_auxiliary(servo, number, value);
}

void txa_take_tool_length(void)
{
    /* While there is a reference tool, G43.1 and the touch-off of a tool change set the difference to it. Homing forgets
     * the reference, but leaves the offset. */
    static bool is_difference;
    tool_offset_mode_t g43 = gc_state.modal.tool_offset_mode;
    float offset = gc_state.modal.tool_length_offset[Z_AXIS], length = length_without_g43;
    if (g43 == ToolLengthOffset_Cancel || g43 == ToolLengthOffset_Enable)
        is_difference = false;
    else if (g43 == ToolLengthOffset_EnableDynamic && bit_istrue(sys.tlo_reference_set.mask, bit(Z_AXIS)))
        is_difference = true;
    if (is_difference)
        length += offset;
    else if (g43 != ToolLengthOffset_Cancel)
        length = offset;
    for (size_t k = 0; k < auxiliaries; k++)
        if (auxiliary[k].kind == TRUEAXIS_TOOL_LENGTH)
            set_auxiliary(k, length);
}

bool trueaxis_set_temperature(const char *name, float celsius)
{
    bool known = false;
    /* A sensor with several lags is several inputs. */
    for (size_t k = 0; servo != NULL && k < auxiliaries; k++)
        if (auxiliary[k].kind == TRUEAXIS_TEMPERATURE && strcmp(auxiliary[k].name, name) == 0) {
            set_auxiliary(k, celsius);
            known = true;
        }
    return known;
}

/* Reports faults, and temperatures beyond their tables, once each when they begin, or when corrections are switched on. */
static void report_faults(void)
{
    uint16_t now = mode == TXA_OFF ? 0 : txa_status().conditions & REPORTED;
    uint16_t fresh = (uint16_t)(now & ~faults);
    faults = now;
    if (fresh != 0) {
        char text[80] = "trueaxis: ";
        trueaxis_conditions_text(fresh, text + strlen(text), sizeof text - strlen(text));
        report_message(text, Message_Warning);
    }
}

static void update(const float *commands, double period)
{
    double in[TRUEAXIS_AXES], out[TRUEAXIS_AXES];
    uint32_t homed = 0;
    for (size_t k = 0; k < axes; k++) {
        in[k] = commands[place[k]];
        if (bit_istrue(sys.homed.mask, bit(place[k])))
            homed |= (uint32_t)1 << k;
    }
    ahead += period;
    if (trueaxis_servo_update(servo, in, axes, homed, period, out) == TRUEAXIS_RESULT_OK)
        for (size_t k = 0; k < axes; k++)
            correction[place[k]] = out[k];
}

void txa_advance(const float *commands, double period)
{
    update(commands, period);
    report_faults();
}

void txa_watch_clock(void)
{
    uint32_t now = hal.get_elapsed_ticks();
    if (servo == NULL || now - watched < LOOK_EVERY)
        return;
    ahead -= 1e-3 * (double)(now - watched);
    watched = now;
    if (ahead < 0.0) {
        trueaxis_servo_pass_time(servo, -ahead);
        ahead = 0.0;
    }
}

void txa_settle(const float *commands)
{
    double before[N_AXIS];
    for (int step = 0; step < MOST_STEPS; step++) {
        memcpy(before, correction, sizeof before);
        update(commands, 0.01);
        bool still = memcmp(before, correction, sizeof before) == 0;
        if (still && !(txa_status().conditions & (TRUEAXIS_RAMPING | TRUEAXIS_FADING)))
            return;
    }
}

void txa_set_travel(const int8_t *directions)
{
    for (size_t k = 0; k < axes; k++)
        if (directions[place[k]] != 0)
            trueaxis_servo_set_travel(servo, k, directions[place[k]]);
}

const double *txa_correction(void)
{
    return correction;
}

bool txa_correction_at(const float *motors, double *correction_there)
{
    double measured[TRUEAXIS_AXES], commands[TRUEAXIS_AXES];
    for (size_t k = 0; k < axes; k++)
        measured[k] = motors[place[k]];
    if (trueaxis_servo_measured(servo, measured, axes, commands) != TRUEAXIS_RESULT_OK)
        return false;
    for (size_t i = 0; i < N_AXIS; i++)
        correction_there[i] = 0.0;
    for (size_t k = 0; k < axes; k++)
        correction_there[place[k]] = measured[k] - commands[k];
    return true;
}

bool txa_acting(void)
{
    return mode == TXA_ON || txa_status().factor > 0.0f;
}

size_t txa_axes(void)
{
    return servo == NULL ? 0 : axes;
}

const trueaxis_axis *txa_axis(size_t number, size_t *where)
{
    *where = place[number];
    return &axis[number];
}

void txa_computed(double *computed)
{
    trueaxis_servo_computed(servo, computed, axes);
}

trueaxis_status txa_status(void)
{
    trueaxis_status status = {0};
    trueaxis_servo_status(servo, &status);
    return status;
}

void txa_machine(char *text, size_t size)
{
    trueaxis_tables_machine(tables, text, size);
}
