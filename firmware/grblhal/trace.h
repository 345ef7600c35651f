/* Ends of the last planned segments, with their corrections: everything between two of them is known exactly.
 *
 * SPDX-License-Identifier: MIT
 * Copyright (c) 2026 The trueaxis maintainers
 */
#ifndef TXA_TRACE_H
#define TXA_TRACE_H

#include "controller.h"

/* Forgets everything recorded so far. */
void txa_trace_forget(void);
/* A path begins here: corrected position and correction, in the order of the axes. */
void txa_trace_begin(const float *position, const double *correction);
/* The path continues straight to here. */
void txa_trace_add(const float *position, const double *correction);
/* This many of the segments are still in the planner. */
void txa_trace_planned(uint32_t blocks);
/* The correction at a corrected position on the path, and the directions in which the axes arrived there (may be
 * null). Returns false if it is not on the path within the rounding to steps. */
bool txa_trace_find(const float *position, double *correction, int8_t *directions);

#endif
