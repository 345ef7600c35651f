/* SPDX-License-Identifier: MIT
 * Copyright (c) 2026 The trueaxis maintainers
 */
#include "pieces.h"
#include "compensation.h"

#include <math.h>

/* Permitted deviation between the correction and the straight line between the ends of a piece: 0.5 µm, and the
 * equivalent angle at a lever of 100 mm. */
#define DEVIATION_MM 0.0005
#define DEVIATION_DEGREES 0.0003
/* Shortest and longest time of a piece at top speed; the planner must be able to keep up. */
#define LEAST_TIME 0.001
#define MOST_TIME 0.1
/* Maximum number of pieces of a motion. */
#define MOST_PIECES 100000

static double piece_time = MOST_TIME;

/* Maximum rate of change of an axis's correction while all axes move at top speed, mm/s or degrees/s, at the
 * steepest place. The bound in the tables is this with a margin of a quarter, plus a ramp. */
static double steepest(size_t number)
{
    size_t place;
    const trueaxis_axis *axis = txa_axis(number, &place);
    return (double)axis->rate_bound - (double)axis->ramp_rate;
}

void txa_pieces_from_tables(void)
{
    piece_time = MOST_TIME;
    for (size_t k = 0; k < txa_axes(); k++) {
        size_t place;
        bool degrees = txa_axis(k, &place)->unit == TRUEAXIS_DEGREES;
        /* A value that changes by at most r per second deviates from the straight line by at most r t / 2. */
        double time = 2.0 * (degrees ? DEVIATION_DEGREES : DEVIATION_MM) / steepest(k);
        if (time > 0.0 && time < piece_time)
            piece_time = time;
    }
    if (piece_time < LEAST_TIME)
        piece_time = LEAST_TIME;
}

double txa_piece_time(void)
{
    return piece_time;
}

double txa_piece_deviation(size_t number)
{
    return 0.5 * piece_time * steepest(number);
}

double txa_time_at_top_speed(const float *from, const float *to)
{
    double time = 0.0;
    for (size_t i = 0; i < N_AXIS; i++) {
        double way = fabs((double)to[i] - (double)from[i]), speed = (double)settings.axis[i].max_rate / 60.0;
        if (way > time * speed)
            time = way / speed;
    }
    return time;
}

uint32_t txa_pieces(const float *from, const float *to)
{
    double pieces = ceil(txa_time_at_top_speed(from, to) / piece_time);
    if (!(pieces > 1.0))
        return 1;
    return pieces < MOST_PIECES ? (uint32_t)pieces : MOST_PIECES;
}

/* The lengths of a motion: for its linear axes and for its rotary axes. */
static void lengths(const float *from, const float *to, double *linear, double *rotary)
{
    *linear = *rotary = 0.0;
    for (size_t i = 0; i < N_AXIS; i++) {
        double way = (double)to[i] - (double)from[i];
        *(TXA_IS_ROTARY(i) ? rotary : linear) += way * way;
    }
    *linear = sqrt(*linear);
    *rotary = sqrt(*rotary);
}

double txa_least_time(const float *from, const float *to, const plan_line_data_t *data)
{
    double fastest = txa_time_at_top_speed(from, to), linear, rotary, time;
    if (data->condition.rapid_motion || data->condition.units_per_rev || data->spindle.state.synchronized)
        return fastest;
    double feed = data->feed_rate;
    lengths(from, to, &linear, &rotary);
    double length = settings.flags.rotary_fix_enable && linear > 0.0 ? linear : hypot(linear, rotary);
    if (data->condition.inverse_time)
        time = 60.0 / feed;
    else
        time = 60.0 * length / (feed > MINIMUM_FEED_RATE ? feed : MINIMUM_FEED_RATE);
    if (!data->condition.no_feed_override)
        time *= 100.0 / MAX_FEED_RATE_OVERRIDE;
    return time > fastest ? time : fastest;
}

bool txa_turns_only(const float *from, const float *to, const plan_line_data_t *data, double *degrees)
{
    double linear;
    lengths(from, to, &linear, degrees);
    return settings.flags.rotary_fix_enable && !data->condition.rapid_motion && !data->condition.inverse_time &&
           linear == 0.0 && *degrees > 0.0;
}
