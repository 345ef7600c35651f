/* A cancelled jog stops at once, a program does not, and at an end of the travel nothing is refused that moves other axes.
 *
 * SPDX-License-Identifier: MIT
 * Copyright (c) 2026 The trueaxis maintainers
 */
#include "check.h"

static size_t cancel_at;
static bool stops; /* by 0x19 */

static void cancel(size_t block)
{
    if (block == cancel_at && stops)
        stop();
    else if (block == cancel_at)
        jog_cancel();
}

static void start(float *place)
{
    const float there[] = {100, 100, -50};
    start_corrected(blob("router-10"));
    memset(place, 0, N_AXIS * sizeof *place);
    memcpy(place, there, sizeof there);
    CHECK(line_to(place, 3000), "there");
    execute();
    planned = executed = 0;
    meanwhile = cancel;
}

/* The planner is full, and a piece waits for room: grblHAL plans it after 0x85, and takes the target of the jog for its
 * end, after 0x19, too. The next line goes where it says from where the jog stopped. */
static void a_long_jog_stops(void)
{
    float to[N_AXIS], at[N_AXIS], after[N_AXIS], motors[N_AXIS];
    start(to);
    for (int jogs = 0; jogs < 20; jogs++) {
        shown(at);
        to[0] = at[0] > 400.0f ? 20.0f : 780.0f;
        cancel_at = planned + (size_t)between(120, 250);
        stops = jogs % 2 == 0;
        displays = jogs % 4 < 2;
        CHECK(jog_to(to, 600), "jogs");
        CHECK(planned == executed, "%zu blocks follow the cancel", planned - executed);
        wait_for(0.1);
        shown(at);
        CHECK(memcmp(at, gc_state.position, sizeof at) == 0, "the parser is elsewhere");
        CHECK(at[0] > 20.1f && at[0] < 779.9f, "stops at %g", (double)at[0]);
        for (size_t i = 0; i < 3; i++)
            motors[i] = motor(i);
        if (jogs % 8 < 4)
            reset();
        for (size_t i = 0; i < 3; i++)
            CHECK(motors[i] == motor(i), "a reset moved an axis");
        cancel_at = (size_t)-1;
        memcpy(after, gc_state.position, sizeof after);
        after[1] += 5.0f;
        CHECK(line_to(after, 600), "a line");
        execute();
        shown(at);
        CHECK(fabsf(at[0] - after[0]) <= 1.0f / 1600.0f, "goes to %g, not to %g", (double)at[0], (double)after[0]);
        to[1] = after[1] > 500.0f ? 100.0f : after[1];
    }
    stops = displays = false;
}

/* A sender may send the character at any time. */
static void a_program_goes_on(void)
{
    float to[N_AXIS], at[N_AXIS];
    start(to);
    to[0] = 500.0f;
    cancel_at = planned + 150;
    CHECK(line_to(to, 3000), "a line");
    execute();
    shown(at);
    CHECK(fabsf(at[0] - 500.0f) <= 1.0f / 1600.0f, "ends at %g", (double)at[0]);
}

/* Homing one axis takes the corrections out, so the others are shown beyond their ends: by no more than their bounds. */
static void an_axis_at_its_end_may_stay(void)
{
    float to[N_AXIS], at[N_AXIS];
    start(to);
    cancel_at = (size_t)-1;
    sys.soft_limits.mask = 7;
    for (size_t i = 0; i < 3; i++) {
        sys.work_envelope.min.values[i] = i == 2 ? -150.0f : 0.0f;
        sys.work_envelope.max.values[i] = i == 2 ? 0.0f : 700.0f;
    }
    /* At both ends of Y, whose corrections have different signs there. */
    bool beyond = false;
    for (int end = 0; end < 2; end++) {
        size_t first = planned;
        to[1] = end ? 700.0f : 0.0f;
        CHECK(line_to(to, 3000), "to the end");
        /* The motors go beyond by the bound at most. */
        for (size_t k = 0; k < oracle.axes; k++)
            for (size_t i = oracle.place[k], block = first; block < planned; block++)
                CHECK(blocks[block].plan.target_mm[i] >= sys.work_envelope.min.values[i] - oracle.axis[k].value_bound &&
                          blocks[block].plan.target_mm[i] <= sys.work_envelope.max.values[i] + oracle.axis[k].value_bound,
                      "the motor of axis %zu goes to %g", i, (double)blocks[block].plan.target_mm[i]);
        execute();
        home_at[2] = -20.0f;
        home(4);
        shown(at);
        beyond = beyond || at[1] < 0.0f || at[1] > 700.0f;
        at[0] = 300.0f - at[0];
        CHECK(line_to(at, 3000) && alarm == 0, "refused beside the end, at %g", (double)at[1]);
        execute();
        float out[N_AXIS];
        memcpy(out, at, sizeof out);
        out[1] = end ? 700.2f : -0.2f;
        CHECK(!jog_to(out, 1000), "a jog beyond the end");
        CHECK(!line_to(out, 1000) && alarm == 2, "beyond the end");
        reset();
        memcpy(to, at, sizeof to);
    }
    CHECK(beyond, "no axis was shown beyond its end");
}

/* Without tables in use, too. */
static void soft_limits_without_tables(void)
{
    float to[N_AXIS] = {0};
    start_with(NULL);
    home(0xFF);
    sys.soft_limits.mask = 7;
    for (size_t i = 0; i < 3; i++)
        sys.work_envelope.min.values[i] = -200.0f;
    to[0] = -200.0f;
    CHECK(line_to(to, 1000) && alarm == 0, "refused");
    execute();
    to[0] = 0.01f;
    CHECK(!line_to(to, 1000) && alarm == 2, "beyond the end");
}

void jogs(void)
{
    a_long_jog_stops();
    a_program_goes_on();
    an_axis_at_its_end_may_stay();
    soft_limits_without_tables();
    meanwhile = NULL;
}
