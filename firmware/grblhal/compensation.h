/* The compensation in terms of the controller's axes: whether it is loaded, and if not, why; its inputs; the
 * corrections.
 *
 * SPDX-License-Identifier: MIT
 * Copyright (c) 2026 The trueaxis maintainers
 */
#ifndef TXA_COMPENSATION_H
#define TXA_COMPENSATION_H

#include "controller.h"
#include "trueaxis.h"

typedef enum { TXA_OFF, TXA_ON, TXA_DRY } txa_mode;

/* Loads the data of `txa_blob`. The previous tables are dropped immediately, so the caller must make sure that
 * nothing moves. Returns false if nothing is loaded; `txa_why` gives the reason. */
bool txa_load(void);
/* True if tables are in use. */
bool txa_present(void);
/* The reason if not. */
const char *txa_why(void);

/* Enables or disables corrections, from the next motion on. */
void txa_set_mode(txa_mode mode);
txa_mode txa_get_mode(void);
/* The tool length (mm) while no G43 is active, and of the reference tool; NAN: unknown. */
void txa_set_length_without_g43(float length);

/* From here on no correction is applied; enabled corrections ramp in again. Temperatures go on. */
void txa_restart(void);
/* Temperatures follow the clock: time that planned motions have not counted passes here. Called whenever grblHAL waits. */
void txa_watch_clock(void);
/* Takes the tool length from the state of the parser. */
void txa_take_tool_length(void);
/* One step: uncorrected positions in the order of the controller's axes, and its duration, 1e-6…0.01 s. */
void txa_advance(const float *commands, double period);
/* Lets time pass at one place until all ramps have ended. */
void txa_settle(const float *commands);
/* Sets the direction in which axes last moved: 1, -1, or 0 if unknown. */
void txa_set_travel(const int8_t *directions);
/* The corrections of the last step, in the order of the controller's axes (mm, degrees). */
const double *txa_correction(void);
/* The corrections at a place where the motors are or were; false during a transition. */
bool txa_correction_at(const float *motors, double *correction_there);
/* True if corrections are applied or ramping: motions must then be cut into pieces. */
bool txa_acting(void);

/* Number of corrected axes; the tables' data of one; and its index in the controller. */
size_t txa_axes(void);
const trueaxis_axis *txa_axis(size_t number, size_t *place);
/* The computed corrections within their bounds, before the fade factor, in the order of the tables. */
void txa_computed(double *computed);
trueaxis_status txa_status(void);
/* The name of the machine. */
void txa_machine(char *text, size_t size);

#endif
