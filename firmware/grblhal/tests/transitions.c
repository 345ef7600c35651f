/* Corrections are enabled and disabled while a program runs: by one factor for all axes, and never with a step.
 *
 * SPDX-License-Identifier: MIT
 * Copyright (c) 2026 The trueaxis maintainers
 */
#include "check.h"

static void change(size_t block)
{
    static const char *const commands[] = {"$TRUEAXIS=ON", "$TRUEAXIS=OFF", "$TRUEAXIS=DRY"};
    if (between(0, 1) < 0.02)
        CHECK(command(commands[(int)between(0, 3)]) == Status_OK, "a command");
    if (block > 0 && between(0, 1) < 0.01)
        CHECK(command("$TRUEAXIS=LOAD") == Status_IdleError, "loaded in motion");
}

/* Number of blocks with a factor between 0 and 1. */
static size_t on_the_way;

static void one_factor(const float *from, const float *to, size_t first)
{
    size_t n = planned - first;
    for (size_t k = 1; k <= n; k += 7) {
        float end[N_AXIS];
        double full[N_AXIS], most = 0.0, factor = 0.0;
        piece_end(from, to, k, n, end);
        corrections_at(end, full);
        const float *at = blocks[first + k - 1].plan.target_mm;
        for (size_t i = 0; i < 3; i++)
            if (fabs(full[i]) > most) {
                most = fabs(full[i]);
                factor = ((double)at[i] - (double)end[i]) / full[i];
            }
        /* f32 positions. */
        double rounding = 2 * 1.6e-5;
        CHECK(factor > -rounding / most && factor < 1.0 + rounding / most, "a factor of %g", factor);
        on_the_way += factor > 0.05 && factor < 0.95;
        for (size_t i = 0; i < N_AXIS; i++) {
            double off = (double)at[i] - (double)end[i] - factor * full[i];
            CHECK(fabs(off) <= rounding * (1.0 + fabs(full[i]) / most), "axis %zu is off its share by %g", i, off);
        }
    }
}

/* Queries the position before the planner has taken the segment: initially the machine is at rest, with nothing
   planned. */
static float asked_at[N_AXIS];

static void ask(size_t block)
{
    float at[N_AXIS];
    shown(block == 0 ? asked_at : at);
}

static void a_report_changes_nothing_in_the_midst_of_a_motion(void)
{
    start_corrected(blob("huron-13"));
    float from[N_AXIS], to[N_AXIS], motors[N_AXIS], before[N_AXIS];
    memcpy(from, started_at, sizeof from);
    for (size_t i = 0; i < N_AXIS; i++)
        motors[i] = motor(i);
    planned = executed = 0;
    meanwhile = ask;
    for (int moves = 0; moves < 60; moves++) {
        size_t first = planned;
        float feed = moves % 4 == 0 ? 0.0f : (float)between(100, 20000);
        /* From rest, followed by the ramp. */
        CHECK(command(moves % 2 == 0 ? "$TRUEAXIS=OFF" : "$TRUEAXIS=ON") == Status_OK, "a command");
        random_place(to);
        shown(before);
        CHECK(line_to(to, feed), "a line");
        for (size_t i = 0; i < N_AXIS; i++)
            CHECK(fabsf(asked_at[i] - before[i]) <= 1.0f / settings.axis[i].steps_per_mm + 1e-4f,
                  "axis %zu stands at %g, and is shown at %g", i, (double)before[i], (double)asked_at[i]);
        /* The motors are at their targets, to half a step. */
        within_rate_bound("asked", motors, from, to, feed, first, moves == 0 ? 0.6 : 0.0);
        memcpy(motors, blocks[planned - 1].plan.target_mm, sizeof motors);
        memcpy(from, to, sizeof from);
        execute();
        planned = executed = 0;
    }
    meanwhile = NULL;
}

static size_t abort_at;

static void abort_line(size_t block)
{
    float at[N_AXIS];
    shown(at);
    aborted = block == abort_at;
}

/* A reset while a piece is on its way to the planner: the next one is never requested. */
static void a_motion_that_is_aborted_leaves_nothing_behind(void)
{
    start_corrected(blob("huron-13"));
    for (int moves = 0; moves < 40; moves++) {
        float from[N_AXIS], to[N_AXIS], motors[N_AXIS], before[N_AXIS], after[N_AXIS];
        random_place(to);
        planned = executed = 0;
        abort_at = (size_t)between(0, 20);
        meanwhile = abort_line;
        CHECK(!line_to(to, 1000) && planned == abort_at, "the line goes on");
        meanwhile = NULL;
        if (planned > 0)
            execute_to(random_block(0), between(0, 1));
        set_state(STATE_IDLE);
        shown(before);
        reset();
        shown(after);
        for (size_t i = 0; i < N_AXIS; i++)
            CHECK(fabsf(after[i] - before[i]) <= 1.0f / settings.axis[i].steps_per_mm + 1e-4f,
                  "axis %zu is shown at %g, and after a reset at %g", i, (double)before[i], (double)after[i]);
        memcpy(from, after, sizeof from);
        for (size_t i = 0; i < N_AXIS; i++)
            motors[i] = motor(i);
        size_t first = planned;
        random_place(to);
        CHECK(line_to(to, 1000), "a line");
        within_rate_bound("after an abort", motors, from, to, 1000, first, 1.2);
        execute();
    }
}

void transitions(void)
{
    a_motion_that_is_aborted_leaves_nothing_behind();
    a_report_changes_nothing_in_the_midst_of_a_motion();
    start_corrected(blob("huron-13"));
    float from[N_AXIS], to[N_AXIS], motors[N_AXIS];
    memcpy(from, started_at, sizeof from);
    for (size_t i = 0; i < N_AXIS; i++)
        motors[i] = motor(i);
    meanwhile = change;
    for (int moves = 0; moves < 300; moves++) {
        size_t first = planned;
        float feed = moves % 4 == 0 ? 0.0f : (float)between(100, 20000);
        random_place(to);
        CHECK(line_to(to, feed), "a line");
        /* The motors are at their targets, to half a step. */
        within_rate_bound("a program", motors, from, to, feed, first, moves == 0 ? 0.6 : 0.0);
        one_factor(from, to, first);
        memcpy(motors, blocks[planned - 1].plan.target_mm, sizeof motors);
        memcpy(from, to, sizeof from);
        if (planned > 100000) {
            execute();
            planned = executed = 0;
        }
    }
    CHECK(on_the_way > 100, "only %zu blocks in a ramp", on_the_way);
    /* At rest a command moves nothing, and the shown position does not change. */
    execute();
    meanwhile = NULL;
    float before[N_AXIS], after[N_AXIS];
    size_t blocks_before = planned;
    shown(before);
    CHECK(command("$TRUEAXIS=OFF") == Status_OK && command("$TRUEAXIS=DRY") == Status_OK, "commands");
    shown(after);
    CHECK(planned == blocks_before && memcmp(before, after, sizeof after) == 0, "a command moved an axis");
    /* Disabled means exactly zero; a dry run computes, but corrects nothing. */
    for (int moves = 0; moves < 10; moves++) {
        random_place(to);
        CHECK(line_to(to, 2000), "a line");
    }
    CHECK(memcmp(blocks[planned - 1].plan.target_mm, to, sizeof to) == 0, "a dry run corrects");
    blocks_before = planned;
    random_place(to);
    CHECK(line_to(to, 2000) && planned == blocks_before + 1, "a line is cut for nothing");
    execute();
    double full[N_AXIS];
    char expected[40];
    corrections_at(to, full);
    snprintf(expected, sizeof expected, "[TRUEAXIS:Y %.5f of %.5f,", 0.0, (double)(float)full[1]);
    said_nothing();
    CHECK(command("$TRUEAXIS") == Status_OK && strstr(said, expected) != NULL && strstr(said, "dry run") != NULL,
          "%s: %s", expected, said);
}
