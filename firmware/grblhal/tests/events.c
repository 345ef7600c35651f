/* A thousand random events, the same in every run: none moves an axis by itself, and no correction changes faster than
 * its bound.
 *
 * SPDX-License-Identifier: MIT
 * Copyright (c) 2026 The trueaxis maintainers
 */
#include "check.h"
#include "../trueaxis_grblhal.h"

static size_t cancel_at;

static void cancel(size_t block)
{
    if (block == cancel_at)
        jog_cancel();
}

/* Permitted distance of the shown position from the motors: the value bounds, and a step. */
static void shown_is_near(const char *what)
{
    float at[N_AXIS];
    shown(at);
    for (size_t j = 0; j < oracle.axes; j++) {
        size_t i = oracle.place[j];
        double off = fabs((double)at[i] - (double)motor(i));
        CHECK(off <= (double)oracle.axis[j].value_bound + 1.0 / (double)settings.axis[i].steps_per_mm + 1e-4,
              "%s: shown %g beside the motor", what, off);
    }
}

static void a_line(const char *name)
{
    float from[N_AXIS], to[N_AXIS], motors[N_AXIS];
    float feed = between(0, 1) < 0.3 ? 0.0f : (float)between(50, 20000);
    size_t first = planned;
    shown(from);
    for (size_t i = 0; i < N_AXIS; i++)
        motors[i] = motor(i);
    random_place(to);
    bool near = between(0, 1) < 0.5;
    for (size_t i = 0; near && i < N_AXIS; i++)
        to[i] = from[i] + 0.02f * (to[i] - from[i]);
    double pieces = ceil(top_speed_time(from, to) / piece_time());
    cancel_at = between(0, 1) < 0.2 ? planned + (size_t)between(0, pieces) : (size_t)-1;
    bool jogs = between(0, 1) < 0.5;
    meanwhile = cancel;
    CHECK(jogs ? jog_to(to, feed + 50.0f) : line_to(to, feed), "%s", name);
    meanwhile = NULL;
    /* Only the start of a cancelled jog is planned; a program goes on. */
    if (!jogs || cancel_at == (size_t)-1)
        within_rate_bound(name, motors, from, to, jogs ? 0.5f * (feed + 50.0f) : feed, first, 1.2);
    else
        CHECK(planned <= cancel_at + 1, "%s: goes on after it was cancelled", name);
    if (cancel_at != (size_t)-1 || between(0, 1) < 0.3) {
        /* Stopped anywhere on the way. */
        float before[N_AXIS], after[N_AXIS], at[N_AXIS];
        if (planned > first && planned > executed)
            execute_to(random_block(first), between(0, 1));
        shown(before);
        for (size_t i = 0; i < N_AXIS; i++)
            at[i] = motor(i);
        reset();
        shown(after);
        for (size_t i = 0; i < N_AXIS; i++)
            CHECK(at[i] == motor(i), "%s: a reset moved axis %zu", name, i);
        CHECK(memcmp(after, gc_state.position, sizeof after) == 0, "%s: the parser is elsewhere", name);
    } else {
        execute();
    }
}

static void an_event(const char *name)
{
    static const char *const commands[] = {"$TRUEAXIS=ON", "$TRUEAXIS=ON", "$TRUEAXIS=OFF", "$TRUEAXIS=DRY",
                                           "$TRUEAXIS=LOAD"};
    int32_t before[N_AXIS];
    double which = between(0, 1);
    memcpy(before, sys.position, sizeof before);
    if (which < 0.3) {
        CHECK(command(commands[(int)between(0, 5)]) == Status_OK, "%s", name);
        CHECK(memcmp(before, sys.position, sizeof before) == 0, "%s: a command moved an axis", name);
    } else if (which < 0.35) {
        sys.homed.mask &= (uint8_t)between(0, 64);
    } else if (which < 0.45) {
        uint8_t mask = (uint8_t)between(1, 64);
        home(mask);
        for (size_t i = 0; i < N_AXIS; i++) {
            int32_t expected = mask & bit(i) ? (int32_t)lroundf(home_at[i] * settings.axis[i].steps_per_mm) : before[i];
            CHECK(sys.position[i] == expected, "%s: homing leaves axis %zu at %d, not %d", name, i, (int)sys.position[i],
                  (int)expected);
            /* From here on the motors are where they are shown: the corrections start at 0. */
            float at[N_AXIS];
            shown(at);
            CHECK(at[i] == motor(i), "%s: corrected after homing", name);
        }
    } else if (which < 0.5) {
        gc_state.modal.tool_length_offset[Z_AXIS] = (float)floor(between(0, 150));
        gc_state.modal.tool_offset_mode = between(0, 1) < 0.2 ? ToolLengthOffset_Cancel : ToolLengthOffset_Enable;
    } else {
        a_line(name);
    }
    shown_is_near(name);
}

/* A reset on the way there, with or without the way back planned after it: for the servo the machine has reversed,
 * but in fact it has not, and its backlash is still that of the way there. */
static void direction_is_that_of_the_motors(void)
{
    start_corrected(blob("router-10"));
    float to[N_AXIS] = {120, 300, -50}, before[N_AXIS], after[N_AXIS];
    CHECK(line_to(to, 3000), "a line");
    execute();
    for (int moves = 0; moves < 20; moves++) {
        size_t first = planned;
        bool there = moves % 2 == 0;
        to[0] = there ? 140.0f : 100.0f;
        CHECK(line_to(to, 300), "there");
        size_t reversal = planned;
        /* Motions of less than a step, for which the planner makes no blocks. */
        for (int none = 0; none < 40; none++) {
            to[1] = none % 2 ? 300.0f : 300.0001f;
            CHECK(line_to(to, 300), "less than a step");
        }
        CHECK(planned == reversal, "blocks");
        to[0] = there ? 100.0f : 140.0f;
        CHECK(moves % 4 < 2 || line_to(to, 300), "and back");
        /* In the second half, where backlash is being caught up. */
        execute_to((first + reversal) / 2 + (size_t)between(0, (double)(reversal - first) / 2), between(0, 1));
        shown(before);
        reset();
        shown(after);
        /* One step for each, plus the permitted deviation of the path from the correction. */
        CHECK(fabsf(before[0] - after[0]) <= 2.0f / 1600.0f + 0.0005f, "shown at %g, then at %g", (double)before[0],
              (double)after[0]);
    }
}

/* A probe stops a line, and only the planner is informed; the next line begins where the motors are. */
static void a_line_begins_at_the_motors(void)
{
    start_corrected(blob("huron-13"));
    float to[N_AXIS] = {-300, 100, 0}, at[N_AXIS];
    CHECK(line_to(to, 2000), "a line");
    execute();
    to[0] = -200;
    size_t first = planned;
    CHECK(line_to(to, 2000), "a line");
    execute_to(first + (planned - first) / 2, 0.5);
    shown(at);
    planned = executed;
    set_state(STATE_IDLE);
    plan_sync_position();
    to[0] = 300;
    first = planned;
    double pieces = ceil(top_speed_time(at, to) / piece_time());
    CHECK(line_to(to, 2000) && fabs((double)(planned - first) - pieces) <= 1.0, "%zu blocks, not %g", planned - first,
          pieces);
}

/* Axes lose their reference, and the corrections go out along a line of which only the start is executed. From there on
 * the axes are where they are shown: nothing is made up in the first piece of the next line. */
static void a_ramp_that_is_cut_short_leaves_nothing(void)
{
    for (int moves = 0; moves < 20; moves++) {
        start_corrected(blob("huron-13"));
        float from[N_AXIS], to[N_AXIS], motors[N_AXIS];
        random_place(to);
        for (size_t i = 0; i < N_AXIS; i++)
            to[i] = started_at[i] + 0.05f * (to[i] - started_at[i]);
        sys.homed.mask = 0;
        CHECK(line_to(to, 200), "a slow line");
        CHECK(planned > 3 && executed == 0, "%zu blocks, %zu executed", planned, executed);
        execute_to((size_t)between(0, 3), between(0, 1));
        set_state(STATE_IDLE);
        reset();
        shown(from);
        for (size_t i = 0; i < N_AXIS; i++)
            motors[i] = motor(i);
        size_t first = planned;
        random_place(to);
        CHECK(line_to(to, 0), "a line");
        within_rate_bound("after a ramp that was cut short", motors, from, to, 0, first, 1.2);
    }
}

void events(void)
{
    a_line_begins_at_the_motors();
    direction_is_that_of_the_motors();
    a_ramp_that_is_cut_short_leaves_nothing();
    static const char *const names[] = {"huron-13", "router-10", "table-head-13"};
    for (size_t k = 0; k < sizeof names / sizeof names[0]; k++) {
        start_corrected(blob(names[k]));
        for (size_t i = 0; i < N_AXIS; i++)
            home_at[i] = k != 1 ? 20.0f : i == 2 ? -20.0f : 20.0f;
        for (int number = 0; number < 1000; number++) {
            an_event(names[k]);
            if (planned > 100000)
                planned = executed = 0;
        }
    }
}
