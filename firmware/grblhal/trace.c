/* SPDX-License-Identifier: MIT
 * Copyright (c) 2026 The trueaxis maintainers
 */
#include "trace.h"

#include <math.h>
#include <string.h>

/* Permitted distance of a position from the path due to rounding to steps, in steps: half a step at each end, and
 * half a step for the position itself. */
#define ROUNDING 1.5

struct place {
    float position[N_AXIS];
    float correction[N_AXIS];
    bool begins;
};

static struct place ring[TRUEAXIS_TRACE];
/* Number of places added, number still stored, and the one at which the motors were seen last. */
static uint32_t added, held, reached;

/* Place number `number`, counted from 1; only the last ones are stored. */
static struct place *at(uint32_t number)
{
    return &ring[number % TRUEAXIS_TRACE];
}

static void add(const float *position, const double *correction, bool begins)
{
    added++;
    if (held < TRUEAXIS_TRACE)
        held++;
    struct place *to = at(added);
    to->begins = begins;
    for (size_t i = 0; i < N_AXIS; i++) {
        to->position[i] = position[i];
        to->correction[i] = (float)correction[i];
    }
}

void txa_trace_forget(void)
{
    held = 0;
}

void txa_trace_begin(const float *position, const double *correction)
{
    add(position, correction, true);
    reached = added;
}

void txa_trace_add(const float *position, const double *correction)
{
    bool moves = false;
    for (size_t i = 0; i < N_AXIS; i++) {
        float steps = settings.axis[i].steps_per_mm;
        moves = moves || lroundf(position[i] * steps) != lroundf(at(added)->position[i] * steps);
    }
    /* The planner makes no block for less. */
    if (moves)
        add(position, correction, false);
}

void txa_trace_planned(uint32_t blocks)
{
    reached = blocks > 0 ? added - blocks + 1 : added;
}

/* Fraction of the way from `a` to `b` that is nearest to the position, 0…1; negative if it is not within rounding. */
static double along(const struct place *a, const struct place *b, const float *position)
{
    double way = 0.0, square = 0.0;
    for (size_t i = 0; i < N_AXIS; i++) {
        double steps = settings.axis[i].steps_per_mm;
        double d = steps * ((double)b->position[i] - (double)a->position[i]);
        way += d * steps * ((double)position[i] - (double)a->position[i]);
        square += d * d;
    }
    double share = square > 0.0 ? way / square : 1.0;
    share = share < 0.0 ? 0.0 : share > 1.0 ? 1.0 : share;
    for (size_t i = 0; i < N_AXIS; i++) {
        double on = (double)a->position[i] + share * ((double)b->position[i] - (double)a->position[i]);
        if (fabs((double)position[i] - on) * (double)settings.axis[i].steps_per_mm > ROUNDING)
            return -1.0;
    }
    return share;
}

/* Direction in which each axis moved last, up to place `number`. */
static void directions_to(uint32_t number, int8_t *directions)
{
    memset(directions, 0, N_AXIS);
    for (; number > added - held + 1; number--) {
        const struct place *b = at(number), *a = at(number - 1);
        for (size_t i = 0; !b->begins && i < N_AXIS; i++) {
            double way = ((double)b->position[i] - (double)b->correction[i]) -
                         ((double)a->position[i] - (double)a->correction[i]);
            /* Anything smaller is rounding of positions. */
            if (directions[i] == 0 && fabs(way) > 1e-4)
                directions[i] = way > 0.0 ? 1 : -1;
        }
    }
}

/* Whether the position is on the segment that ends at place `number`. */
static bool on_segment(uint32_t number, const float *position, double *correction)
{
    if (number > added || number + held <= added)
        return false;
    const struct place *b = at(number);
    const struct place *a = b->begins || number == added - held + 1 ? b : at(number - 1);
    double share = along(a, b, position);
    for (size_t i = 0; share >= 0.0 && i < N_AXIS; i++)
        correction[i] = (double)a->correction[i] + share * ((double)b->correction[i] - (double)a->correction[i]);
    return share >= 0.0;
}

bool txa_trace_find(const float *position, double *correction, int8_t *directions)
{
    /* A path may pass the same place several times, with backlash in between: choose the segment nearest to where
     * the motors were seen last. */
    for (uint32_t off = 0; off < TRUEAXIS_TRACE; off++)
        for (int side = 0; side < 2; side++) {
            uint32_t number = side == 0 ? reached - off : reached + off;
            if (!on_segment(number, position, correction))
                continue;
            if (directions != NULL)
                directions_to(number, directions);
            return true;
        }
    return false;
}
