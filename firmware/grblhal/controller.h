/* The parts of grblHAL that are used, and build options.
 *
 * SPDX-License-Identifier: MIT
 * Copyright (c) 2026 The trueaxis maintainers
 */
#ifndef TXA_CONTROLLER_H
#define TXA_CONTROLLER_H

#include "grbl/hal.h"
#include "grbl/kinematics/interface.h"
#include "grbl/machine_limits.h"
#include "grbl/planner.h"
#include "grbl/protocol.h"
#include "grbl/report.h"
#include "grbl/state_machine.h"
#include "grbl/vfs.h"

#ifndef KINEMATICS_API
#error "trueaxis corrects in the kinematics of grblHAL: define KINEMATICS_API for the whole build"
#endif
#if COREXY || WALL_PLOTTER || DELTA_ROBOT || POLAR_ROBOT || defined(ASYMMETRIC_GANGING) || defined(ASYMMETRIC_AUTO_SQUARE)
#error "trueaxis corrects axes: with these kinematics a motor is not an axis of its own"
#endif
#if ENABLE_BACKLASH_COMPENSATION
#error "trueaxis makes up for backlash with its tables: build grblHAL without ENABLE_BACKLASH_COMPENSATION"
#endif

/* Whether an axis is rotary ($376). With three axes grblHAL has no such setting. */
#if N_AXIS > 3
#define TXA_IS_ROTARY(axis) bit_istrue(settings.steppers.is_rotary.mask, bit(axis))
#else
#define TXA_IS_ROTARY(axis) ((void)(axis), false)
#endif

/* The file with the tables, in the file system of grblHAL. */
#ifndef TRUEAXIS_FILE
#define TRUEAXIS_FILE "/trueaxis.trax"
#endif
/* The largest file that fits, bytes. */
#ifndef TRUEAXIS_FILE_MOST
#define TRUEAXIS_FILE_MOST 16384
#endif
/* To keep tables in flash instead: the address, aligned to 4, and TRUEAXIS_FLASH_SIZE, the size of the area in
 * bytes.
 * #define TRUEAXIS_FLASH ((const void *)0x080E0000) */

/* 1: corrections are enabled from the start, otherwise with `$TRUEAXIS=ON`. */
#ifndef TRUEAXIS_ON_AT_START
#define TRUEAXIS_ON_AT_START 0
#endif
/* Number of planned segments remembered for the shown position: more than the planner has blocks. */
#ifndef TRUEAXIS_TRACE
#define TRUEAXIS_TRACE 128
#endif

#endif
