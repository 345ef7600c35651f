/* Feeds are the same as without corrections; soft limits hold; checking a program changes nothing.
 *
 * SPDX-License-Identifier: MIT
 * Copyright (c) 2026 The trueaxis maintainers
 */
#include "check.h"
#include "../pieces.h"

/* Duration of a line, min, as the planner applies the feeds of its blocks to a length of `length`. */
static double minutes(size_t first, double length)
{
    double sum = 0.0, pieces = (double)(planned - first);
    for (size_t k = first; k < planned; k++) {
        const plan_line_data_t *data = &blocks[k].data;
        sum += data->condition.inverse_time ? 1.0 / (double)data->feed_rate
                                            : length / pieces / (double)data->feed_rate;
    }
    return sum;
}

static void takes(const char *what, const float *to, plan_line_data_t data, double length, double expected)
{
    size_t first = planned;
    CHECK(line(to, data), "%s", what);
    CHECK(planned > first + 3, "%s: %zu blocks", what, planned - first);
    CHECK(fabs(minutes(first, length) / expected - 1.0) < 1e-5, "%s: %g min, not %g", what, minutes(first, length),
          expected);
    CHECK(last_data.condition.inverse_time == data.condition.inverse_time, "%s: the feed became a time", what);
    for (size_t k = first; k < planned; k++)
        CHECK(blocks[k].data.rate_multiplier == 1.0f, "%s: a multiplier", what);
    execute();
}

static void feeds_are_kept(void)
{
    start_corrected(blob("huron-13"));
    float to[N_AXIS] = {0};
    plan_line_data_t data = {.feed_rate = 1000.0f}, by_time = {.feed_rate = 4.0f};
    by_time.condition.inverse_time = On;
    CHECK(line_to(to, 0), "a line");
    execute();
    to[0] = 100;
    takes("mm/min", to, data, 100, 0.1);
    to[0] = 0;
    takes("inverse time", to, by_time, 100, 0.25);
    /* Only C turns: the feed must not be applied to linear corrections of µm. */
    to[5] = 90;
    takes("degrees/min", to, data, 90, 0.09);
    CHECK(blocks[planned - 1].data.condition.inverse_time, "of degrees");
    to[5] = 0;
    takes("a turn by inverse time", to, by_time, 90, 0.25);
    gc_state.modal.units_imperial = true;
    settings.flags.revert_metric_conversion = 1;
    to[5] = 90;
    data.feed_rate = 25400.0f;
    takes("degrees/min, in inches", to, data, 90, 0.09);
    gc_state.modal.units_imperial = false;
    gc_state.modal.units_imperial = true;
    settings.flags.rotary_fix_enable = 0;
    to[5] = 0;
    takes("without the fix for rotary axes", to, data, 90, 90.0 / 25400.0);
    gc_state.modal.units_imperial = false;
    /* Nothing takes for ever, and nothing is too short. */
    CHECK(line_to(to, 1), "nowhere");
    to[0] = 300;
    CHECK(line_to(to, 0.001f), "slow");
    to[0] = 300.001f;
    CHECK(line_to(to, 30000), "short");
    data.condition.units_per_rev = On;
    data.feed_rate = 0.1f;
    to[0] = 200;
    CHECK(line(to, data), "per revolution");
    execute();
}

/* The time given to the servo is never longer than the planner's shortest: at twice the feed, unless overrides are
 * off, and at most at top speed, 500 mm/s and 180 degrees/s. */
static void no_piece_is_faster(void)
{
    const float from[N_AXIS] = {0}, by_x[N_AXIS] = {100}, by_c[N_AXIS] = {[N_AXIS - 1] = 90},
                by_both[N_AXIS] = {100, [N_AXIS - 1] = 90};
    plan_line_data_t data = {.feed_rate = 6000};
    start_with(NULL);
    CHECK(txa_least_time(from, by_x, &data) == 0.5, "mm/min");
    CHECK(txa_least_time(from, by_both, &data) == 0.5, "mm/min of the linear axes");
    CHECK(txa_least_time(from, by_c, &data) == 0.5, "top speed");
    data.feed_rate = 1800;
    CHECK(txa_least_time(from, by_c, &data) == 1.5, "degrees/min");
    data.condition.no_feed_override = On;
    CHECK(txa_least_time(from, by_x, &data) == 100.0 / 30.0, "no override");
    data.condition.inverse_time = On;
    data.feed_rate = 60;
    CHECK(txa_least_time(from, by_x, &data) == 1.0, "inverse time");
    data.condition.rapid_motion = On;
    CHECK(txa_least_time(from, by_x, &data) == 0.2, "a rapid");
    data = (plan_line_data_t){.feed_rate = 0.1f, .spindle.state.synchronized = 1};
    CHECK(txa_least_time(from, by_x, &data) == 0.2, "by the spindle");
    data = (plan_line_data_t){.feed_rate = 0.01f};
    CHECK(txa_least_time(from, by_x, &data) == 3000.0, "the planner's least feed");
    settings.flags.rotary_fix_enable = 0;
    data.feed_rate = 6000;
    CHECK(fabs(txa_least_time(from, by_both, &data) / (0.005 * sqrt(18100.0)) - 1.0) < 1e-12, "of all axes");
}

static void soft_limits_hold(void)
{
    start_corrected(blob("huron-13"));
    float to[N_AXIS] = {0}, motors[N_AXIS];
    for (size_t i = 0; i < N_AXIS; i++) {
        sys.work_envelope.max.values[i] = i < 3 ? 350.0f : 400.0f;
        sys.work_envelope.min.values[i] = -sys.work_envelope.max.values[i];
    }
    sys.soft_limits.mask = (uint8_t)(bit(N_AXIS) - 1);
    for (int moves = 0; moves < 100; moves++) {
        size_t first = planned;
        for (size_t i = 0; i < 3; i++)
            to[i] = between(0, 1) < 0.3 ? (between(0, 1) < 0.5 ? -350.0f : 350.0f) : (float)floor(between(-350, 350));
        to[3] = (float)floor(between(-119, 119));
        to[5] = (float)floor(between(-359, 359));
        CHECK(line_to(to, 5000), "the end of the travel is refused");
        for (size_t k = first; k < planned; k++)
            for (size_t i = 0; i < 3; i++)
                CHECK(fabsf(blocks[k].plan.target_mm[i]) <= 350.0f, "the correction leads out of the travel");
        size_t before = planned;
        to[moves % 3] = 350.01f;
        CHECK(!line_to(to, 5000) && planned == before && alarm == 2, "beyond the travel");
        /* grblHAL stops here with an alarm, and a reset. */
        execute();
        for (size_t i = 0; i < N_AXIS; i++)
            motors[i] = motor(i);
        reset();
        for (size_t i = 0; i < N_AXIS; i++)
            CHECK(motors[i] == motor(i), "a reset moved an axis");
    }
}

static void checking_changes_nothing(void)
{
    start_corrected(blob("huron-13"));
    float at[N_AXIS], after[N_AXIS], to[N_AXIS];
    shown(at);
    set_state(STATE_CHECK_MODE);
    for (int moves = 0; moves < 20; moves++) {
        random_place(to);
        CHECK(line_to(to, 1000) && planned == 0, "planned");
    }
    set_state(STATE_IDLE);
    shown(after);
    CHECK(memcmp(at, after, sizeof at) == 0, "another position");
}

void feeds(void)
{
    feeds_are_kept();
    no_piece_is_faster();
    soft_limits_hold();
    checking_changes_nothing();
}
