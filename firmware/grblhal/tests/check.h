/* Code shared by the tests: checks, random numbers, blobs, and the library's corrections at a place.
 *
 * SPDX-License-Identifier: MIT
 * Copyright (c) 2026 The trueaxis maintainers
 */
#ifndef CHECK_H
#define CHECK_H

#include "standin/controller.h"
#include "trueaxis.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Ends the program if a condition is false. */
#define CHECK(holds, ...)                                                                                             \
    do {                                                                                                              \
        if (!(holds)) {                                                                                               \
            fprintf(stderr, "%s:%d: %s: ", __FILE__, __LINE__, #holds);                                               \
            fprintf(stderr, __VA_ARGS__);                                                                             \
            fprintf(stderr, "\n");                                                                                    \
            exit(1);                                                                                                  \
        }                                                                                                             \
    } while (0)

/* A random number from `low` to `high`: the same sequence in every run. */
double between(double low, double high);

/* Blobs, named as in tests/golden. */
struct blob {
    const char *name;
    uint32_t bytes[4096];
    size_t length;
};
struct blob *blob(const char *name);
void read_blobs(const char *folder);

/* Starts a controller with this file; `said` contains its messages. */
void start_with(const struct blob *file);
/* The same, homed, in the middle of the travel, with the corrections fully in. */
void start_corrected(const struct blob *file);
/* That position: the last command. */
extern float started_at[N_AXIS];
/* A random place in the travel of the tables, a whole number of steps. */
void random_place(float *place);

/* The tables of the last start again: their axes, and the corrections of a servo at rest. */
struct oracle {
    size_t axes;
    trueaxis_axis axis[TRUEAXIS_AXES];
    size_t place[TRUEAXIS_AXES];
};
extern struct oracle oracle;
void corrections_at(const float *command, double *correction);
/* Time (s) of a piece at top speed, from the facts: the feed rule. */
double piece_time(void);
/* Time (s) of a motion at top speed of its axes. */
double top_speed_time(const float *from, const float *to);

/* The uncorrected end of piece `k` of `n`. */
void piece_end(const float *from, const float *to, size_t k, size_t n, float *end);
/* Checks that no correction changes faster than its rate bound, whatever the overrides, along a line whose first
 * block is `first`, starting at the previous motor and shown positions (exact, or to a step). */
void within_rate_bound(const char *what, const float *motors, const float *from, const float *to, float feed,
                       size_t first, double steps);

/* A random block, not yet executed, from `first` on. */
size_t random_block(size_t first);

/* The tests. */
void refused(void);
void exact(void);
void transitions(void);
void events(void);
void kinematics_within(void);
void feeds(void);
void inputs(void);
void probing(void);
void jogs(void);

#endif
