/* Where the last planned segments ended, with their corrections: what is between two of them is known exactly.
 *
 * SPDX-License-Identifier: MIT
 * Copyright (c) 2026 The trueaxis maintainers
 */
#ifndef TXA_TRACE_H
#define TXA_TRACE_H

#include "controller.h"

/* Nothing of before holds any more. */
void txa_trace_forget(void);
/* A path begins here: corrected position and correction, by axes. */
void txa_trace_begin(const float *position, const double *correction);
/* It goes on straight to here. */
void txa_trace_add(const float *position, const double *correction);
/* So many of the segments are still in the planner. */
void txa_trace_planned(uint32_t blocks);
/* The correction at a corrected position on the path, and in which direction the axes came there (may be null).
 * False: it is not on the path, by more than the rounding to steps. */
bool txa_trace_find(const float *position, double *correction, int8_t *directions);

#endif
