/* Number of pieces of a motion, and duration of a piece.
 *
 * SPDX-License-Identifier: MIT
 * Copyright (c) 2026 The trueaxis maintainers
 */
#ifndef TXA_PIECES_H
#define TXA_PIECES_H

#include "controller.h"

/* Takes the steepest slopes from the tables in use. */
void txa_pieces_from_tables(void);
/* Duration of a piece at top speed, s: the feed rule of the manual. */
double txa_piece_time(void);
/* Largest deviation of the planned path from the correction between the ends of such a piece (mm, degrees). */
double txa_piece_deviation(size_t axis);

/* Duration of a motion at top speed, s: no override is faster. */
double txa_time_at_top_speed(const float *from, const float *to);
/* Number of pieces into which it is cut. */
uint32_t txa_pieces(const float *from, const float *to);
/* Shortest time, s, for a piece with this feed, whatever the overrides. */
double txa_least_time(const float *from, const float *to, const plan_line_data_t *data);
/* True if only rotary axes move, with a feed in degrees per minute; `degrees` is then the length of the motion. */
bool txa_turns_only(const float *from, const float *to, const plan_line_data_t *data, double *degrees);

#endif
