/* Into how many pieces a motion is cut, and how long a piece takes.
 *
 * SPDX-License-Identifier: MIT
 * Copyright (c) 2026 The trueaxis maintainers
 */
#ifndef TXA_PIECES_H
#define TXA_PIECES_H

#include "controller.h"

/* Takes the steepest places from the tables in use. */
void txa_pieces_from_tables(void);
/* How long a piece takes at top speed, s: the feed rule of the manual. */
double txa_piece_time(void);
/* How far the path of the planner can be from the correction between two ends of such a piece (mm, degrees). */
double txa_piece_deviation(size_t axis);

/* The time of a motion at top speed, s: no override is faster. */
double txa_time_at_top_speed(const float *from, const float *to);
/* Into how many pieces it is cut. */
uint32_t txa_pieces(const float *from, const float *to);
/* The least time, s, that a piece can take with this feed, whatever the overrides. */
double txa_least_time(const float *from, const float *to, const plan_line_data_t *data);
/* True if only rotary axes move, by degrees per minute: then `degrees` is the length of the motion. */
bool txa_turns_only(const float *from, const float *to, const plan_line_data_t *data, double *degrees);

#endif
