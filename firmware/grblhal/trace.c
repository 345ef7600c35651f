/* SPDX-License-Identifier: MIT
 * Copyright (c) 2026 The trueaxis maintainers
 */
#include "trace.h"

#include <math.h>
#include <string.h>

/* How far from the path a position may be for the rounding to steps, steps: half a step at each end, and half a
 * step of where it stands. */
#define ROUNDING 1.5

struct place {
    float position[N_AXIS];
    float correction[N_AXIS];
    bool begins;
};

static struct place ring[TRUEAXIS_TRACE];
static size_t newest, held;

static void add(const float *position, const double *correction, bool begins)
{
    newest = (newest + 1) % TRUEAXIS_TRACE;
    if (held < TRUEAXIS_TRACE)
        held++;
    struct place *to = &ring[newest];
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
}

void txa_trace_add(const float *position, const double *correction)
{
    add(position, correction, false);
}

static const struct place *before_newest(size_t count)
{
    return &ring[(newest + TRUEAXIS_TRACE - count) % TRUEAXIS_TRACE];
}

/* How far along from `a` to `b` the position is nearest, 0…1; negative: nowhere within the rounding to steps. */
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

/* In which direction each axis moved last, up to the segment that ends `count` before the newest. */
static void directions_to(size_t count, int8_t *directions)
{
    memset(directions, 0, N_AXIS);
    for (; count + 1 < held; count++) {
        const struct place *b = before_newest(count), *a = before_newest(count + 1);
        for (size_t i = 0; !b->begins && i < N_AXIS; i++) {
            double way = ((double)b->position[i] - (double)b->correction[i]) -
                         ((double)a->position[i] - (double)a->correction[i]);
            /* What is less is the rounding of positions. */
            if (directions[i] == 0 && fabs(way) > 1e-4)
                directions[i] = way > 0.0 ? 1 : -1;
        }
    }
}

bool txa_trace_find(const float *position, double *correction, int8_t *directions)
{
    for (size_t count = 0; count < held; count++) {
        const struct place *b = before_newest(count);
        const struct place *a = b->begins || count + 1 == held ? b : before_newest(count + 1);
        double share = along(a, b, position);
        if (share < 0.0)
            continue;
        for (size_t i = 0; i < N_AXIS; i++)
            correction[i] = (double)a->correction[i] +
                            share * ((double)b->correction[i] - (double)a->correction[i]);
        if (directions != NULL)
            directions_to(count, directions);
        return true;
    }
    return false;
}
