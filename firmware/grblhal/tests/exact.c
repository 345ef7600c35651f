/* Every segment ends where the library says, and the shown position is the commanded one.
 *
 * SPDX-License-Identifier: MIT
 * Copyright (c) 2026 The trueaxis maintainers
 */
#include "check.h"

/* An axis with backlash: it does not move, because all axes catch up after one of them reverses (`events`). */
#define NONE N_AXIS
static size_t backlash;

/* The number of blocks of a line follows the feed rule, and they end exactly where the library says. */
static void ends_are_exact(const char *name, const float *from, const float *to, size_t first)
{
    size_t n = planned - first;
    double pieces = ceil(top_speed_time(from, to) / piece_time());
    CHECK((double)n == fmax(pieces, 1.0), "%s: %zu blocks, not %g", name, n, pieces);
    for (size_t k = 1; k <= n; k++) {
        float end[N_AXIS];
        double correction[N_AXIS];
        piece_end(from, to, k, n, end);
        corrections_at(end, correction);
        for (size_t i = 0; i < N_AXIS; i++) {
            if (i == backlash)
                continue;
            float expected = (float)((double)end[i] + correction[i]), is = blocks[first + k - 1].plan.target_mm[i];
            CHECK(memcmp(&expected, &is, sizeof is) == 0, "%s, axis %zu, piece %zu of %zu: %.9g, not %.9g", name, i, k,
                  n, (double)is, (double)expected);
        }
    }
}

/* Half a step each: the ends of the block, the motor position on it, and the shown position; at an end two of them.
 * Plus f32 rounding at 1000 mm. */
static double shown_within(size_t axis, double steps)
{
    return steps / (double)settings.axis[axis].steps_per_mm + 6e-5;
}

/* Number of line ends, and number shown exactly as given, to the step. */
static size_t stands, as_given;

static void shown_is_commanded(const char *name, const float *from, const float *to, size_t first)
{
    size_t n = planned - first;
    float at[N_AXIS], end[N_AXIS], begin[N_AXIS];
    for (int trial = 0; trial < 5; trial++) {
        size_t k = random_block(first) - first;
        double share = between(0, 1);
        execute_to(first + k, share);
        shown(at);
        piece_end(from, to, k, n, begin);
        piece_end(from, to, k + 1, n, end);
        for (size_t i = 0; i < N_AXIS; i++) {
            double expected = (double)begin[i] + share * ((double)end[i] - (double)begin[i]);
            CHECK(fabs((double)at[i] - expected) <= shown_within(i, 1.5), "%s: %zu shown at %.7g, not %.7g", name, i,
                  (double)at[i], expected);
        }
    }
    execute();
    shown(at);
    for (size_t i = 0; i < N_AXIS; i++) {
        CHECK(fabs((double)at[i] - (double)to[i]) <= shown_within(i, 1.0), "%s: %zu shown at %.7g, not %.7g", name, i,
              (double)at[i], (double)to[i]);
        stands++;
        as_given += lroundf(at[i] * settings.axis[i].steps_per_mm) == lroundf(to[i] * settings.axis[i].steps_per_mm);
    }
}

/* Along each block the motors move straight; the correction is nowhere farther away than the feed rule permits. */
static void path_is_near(const char *name, const float *from, const float *to, size_t first)
{
    size_t n = planned - first;
    for (size_t k = 0; k < n; k++) {
        float begin[N_AXIS], end[N_AXIS];
        double here[N_AXIS], a[N_AXIS], b[N_AXIS];
        double share = between(0.2, 0.8);
        float between_them[N_AXIS];
        piece_end(from, to, k, n, begin);
        piece_end(from, to, k + 1, n, end);
        corrections_at(begin, a);
        corrections_at(end, b);
        for (size_t i = 0; i < N_AXIS; i++)
            between_them[i] = (float)((double)begin[i] + share * ((double)end[i] - (double)begin[i]));
        corrections_at(between_them, here);
        for (size_t i = 0; i < N_AXIS; i++) {
            /* 1e-6: corrections are f32. */
            double most = (i >= 3 ? 0.0003 : 0.0005) + 1e-6;
            double off = fabs(a[i] + share * (b[i] - a[i]) - here[i]);
            CHECK(i == backlash || off <= most, "%s: axis %zu is %g off the correction", name, i, off);
        }
    }
}

void exact(void)
{
    static const char *const names[] = {"huron-13", "table-head-13"};
    for (size_t k = 0; k < sizeof names / sizeof names[0]; k++) {
        start_corrected(blob(names[k]));
        backlash = k == 0 ? NONE : 4;
        float from[N_AXIS], to[N_AXIS], earlier[N_AXIS] = {0};
        mpos_t earlier_steps = {{0}};
        memcpy(from, started_at, sizeof from);
        for (int moves = 0; moves < 60; moves++) {
            size_t first = planned;
            random_place(to);
            /* Including short ones, as in arcs. */
            for (size_t i = 0; moves % 3 == 0 && i < N_AXIS; i++)
                to[i] = (float)(from[i] + floor(0.01f * (to[i] - from[i]) * 100.0f) / 100.0f);
            if (backlash != NONE)
                to[backlash] = from[backlash];
            CHECK(line_to(to, moves % 2 ? (float)between(50, 30000) : 0.0f), "%s", names[k]);
            ends_are_exact(names[k], from, to, first);
            path_is_near(names[k], from, to, first);
            shown_is_commanded(names[k], from, to, first);
            memcpy(from, to, sizeof from);
            if (moves == 0) {
                memcpy(earlier, to, sizeof earlier);
                memcpy(earlier_steps.values, sys.position, sizeof sys.position);
            }
        }
        /* A place from long ago, such as where a probe touched. */
        float at[N_AXIS];
        system_convert_array_steps_to_mpos(at, earlier_steps.values);
        for (size_t i = 0; i < N_AXIS; i++)
            CHECK(i == backlash || fabs((double)at[i] - (double)earlier[i]) <= shown_within(i, 1.0),
                  "%s: %zu was shown at %g", names[k], i, (double)at[i]);
    }
    /* Except where the rounding of f32 positions, up to a tenth of a step, decides between two steps. */
    CHECK(as_given * 20 > stands * 19, "%zu of %zu shown as given", as_given, stands);
}
