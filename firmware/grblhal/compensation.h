/* The compensation by the axes of the controller: loaded or not, and why not; its inputs; one correction after
 * the other.
 *
 * SPDX-License-Identifier: MIT
 * Copyright (c) 2026 The trueaxis maintainers
 */
#ifndef TXA_COMPENSATION_H
#define TXA_COMPENSATION_H

#include "controller.h"
#include "trueaxis.h"

typedef enum { TXA_OFF, TXA_ON, TXA_DRY } txa_mode;

/* Loads what `txa_blob` has. Before it nothing is in use any more, at once: the caller sees to it that nothing
 * moves. False: nothing is loaded, and `txa_why` says why. */
bool txa_load(void);
/* True if tables are in use. */
bool txa_present(void);
/* Why not. */
const char *txa_why(void);

/* Lets the corrections in or takes them out, with the next motion. */
void txa_set_mode(txa_mode mode);
txa_mode txa_get_mode(void);
/* The tool length (mm) while no G43 is active; NAN: not known. */
void txa_set_length_without_g43(float length);

/* From here on no correction is in, and what is let in comes by the ramp. */
void txa_restart(void);
/* Takes the tool length from the state of the parser. */
void txa_take_tool_length(void);
/* One step: uncorrected positions by the controller's axes, and how long it lasts, 1e-6…0.01 s. */
void txa_advance(const float *commands, double period);
/* Lets time pass at a place, until ramps have ended. */
void txa_settle(const float *commands);
/* Says in which direction axes last moved: 1, -1, or 0 not known. */
void txa_set_travel(const int8_t *directions);
/* The corrections of the last step, by the controller's axes (mm, degrees). */
const double *txa_correction(void);
/* The corrections at a place where the motors stand or stood; false while something is on its way. */
bool txa_correction_at(const float *motors, double *correction_there);
/* True if corrections are in, or on their way: motions have to be cut into pieces. */
bool txa_acting(void);

/* Number of corrected axes; what the tables say of one; and which it is in the controller. */
size_t txa_axes(void);
const trueaxis_axis *txa_axis(size_t number, size_t *place);
/* The corrections as computed, within their bounds, before they are let in, in the order of the tables. */
void txa_computed(double *computed);
trueaxis_status txa_status(void);
/* The name of the machine. */
void txa_machine(char *text, size_t size);

#endif
