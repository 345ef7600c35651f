/* trueaxis: volumetric compensation at servo rate. The manual: docs/src/c-interface.md
 *
 * SPDX-License-Identifier: MIT OR Apache-2.0
 *
 * No function allocates, waits or calls the operating system. All but `trueaxis_tables_load…` may be called
 * from a real-time thread. Objects are in memory of the caller, which stays where it is:
 *
 *     static trueaxis_tables_memory memory;
 *     trueaxis_tables *tables;
 *     trueaxis_result result = trueaxis_tables_new(TRUEAXIS_HEADER, &memory, sizeof memory, &tables);
 *
 * A pointer to an object is null, or was written by `trueaxis_…_new`: that is what the caller promises, and
 * null is refused. Nothing is read from memory that the library has not written before, so that memory need
 * not be cleared.
 *
 * One thread uses a servo at a time, and one thread tables; tables that a servo holds may be asked from
 * others. Tables are loaded by one thread and handed over to that of the servo (a queue, a pointer that is
 * released and acquired).
 *
 * Positions and corrections are in mm and degrees, times in seconds. "Safety" is what the caller promises
 * and the library cannot check.
 */


#ifndef TRUEAXIS_H
#define TRUEAXIS_H

/* Written by cbindgen from firmware/capi/src: UPDATE_HEADER=1 cargo test -p trueaxis-capi --test header */

#include <stddef.h>
#include <stdint.h>

/* What the library holds. It was built with these numbers in environment variables of the same names; a
 * program with others is refused by `trueaxis_tables_new`. */
#ifndef TRUEAXIS_AXES
#define TRUEAXIS_AXES 8 /* axes */
#endif
#ifndef TRUEAXIS_BANKS
#define TRUEAXIS_BANKS 32 /* banks of tables */
#endif
#ifndef TRUEAXIS_TABLES
#define TRUEAXIS_TABLES 96 /* tables, of all banks */
#endif
#ifndef TRUEAXIS_TERMS
#define TRUEAXIS_TERMS 256 /* terms */
#endif
#ifndef TRUEAXIS_GRIDS
#define TRUEAXIS_GRIDS 2 /* grids */
#endif

/* This header, with its capacities, as `trueaxis_tables_new` compares it with the library. */
#define TRUEAXIS_HEADER \
    ((uint64_t)TRUEAXIS_ABI << 56 | (uint64_t)TRUEAXIS_AXES << 48 | \
     (uint64_t)TRUEAXIS_BANKS << 40 | (uint64_t)TRUEAXIS_TABLES << 32 | \
     (uint64_t)TRUEAXIS_TERMS << 16 | (uint64_t)TRUEAXIS_GRIDS)


/*
 Grows whenever a program that was built with the header before could go wrong.
 */
#define TRUEAXIS_ABI 2

/*
 Words of 8 bytes that tables take: so many whatever the capacities, and for each axis, bank, table, term
 and grid.
 */
#define TRUEAXIS_TABLES_WORDS (((((100 + (6 * TRUEAXIS_AXES)) + (12 * TRUEAXIS_BANKS)) + TRUEAXIS_TABLES) + ((5 * TRUEAXIS_TERMS) / 2)) + (34 * TRUEAXIS_GRIDS))

/*
 The same in bytes.
 */
#define TRUEAXIS_TABLES_SIZE (8 * TRUEAXIS_TABLES_WORDS)

/*
 Words of 8 bytes that a servo takes: so many whatever the capacities, and for each axis.
 */
#define TRUEAXIS_SERVO_WORDS (120 + (22 * TRUEAXIS_AXES))

/*
 The same in bytes.
 */
#define TRUEAXIS_SERVO_SIZE (8 * TRUEAXIS_SERVO_WORDS)

/*
 Memory for tables and servos starts at a multiple of this many bytes.
 */
#define TRUEAXIS_ALIGNMENT 8

/*
 Most auxiliary inputs.
 */
#define TRUEAXIS_AUXILIARIES 8

/*
 Most adjustable terms.
 */
#define TRUEAXIS_ADJUSTABLE 16

/*
 Bytes of a name, with the zero at its end.
 */
#define TRUEAXIS_NAME_SIZE 17

/*
 Unit: mm.
 */
#define TRUEAXIS_MM 0

/*
 Unit: degrees.
 */
#define TRUEAXIS_DEGREES 1

/*
 An auxiliary input: the length of the tool, mm.
 */
#define TRUEAXIS_TOOL_LENGTH 0

/*
 An auxiliary input: a temperature, °C.
 */
#define TRUEAXIS_TEMPERATURE 1

/*
 Rotary axes are corrected for the orientation of the tool.
 */
#define TRUEAXIS_ORIENTATION 0

/*
 Rotary axes are corrected for the direction of the tool.
 */
#define TRUEAXIS_DIRECTION 1

/*
 Rotary axes are not corrected.
 */
#define TRUEAXIS_POSITION 2

/*
 Condition: an input is not a number, infinite, or out of reach.
 */
#define TRUEAXIS_BAD_INPUT 1

/*
 Condition: the period is not from 1 µs to 10 ms.
 */
#define TRUEAXIS_BAD_PERIOD (1 << 1)

/*
 Condition: an axis on which a correction depends is not referenced.
 */
#define TRUEAXIS_UNREFERENCED (1 << 2)

/*
 Condition: the computed correction is that of an earlier period.
 */
#define TRUEAXIS_HELD (1 << 3)

/*
 Condition: after a fault or the loss of a reference, until the common factor has come to 0.
 */
#define TRUEAXIS_FROZEN (1 << 4)

/*
 Condition: the common factor is on its way to 0 or 1.
 */
#define TRUEAXIS_RAMPING (1 << 5)

/*
 Condition: other tables, weights or auxiliaries are being faded in, or wait for it.
 */
#define TRUEAXIS_FADING (1 << 6)

/*
 Condition: not enabled.
 */
#define TRUEAXIS_DISABLED (1 << 7)

/*
 Condition: a dry run.
 */
#define TRUEAXIS_DRY_RUN (1 << 8)

/*
 Condition: a tool length or a temperature that matters was never set or is not usable.
 */
#define TRUEAXIS_BAD_AUXILIARY (1 << 9)

/*
 Condition: nothing is loaded, so nothing is corrected.
 */
#define TRUEAXIS_NOTHING_LOADED (1 << 10)

#if defined(TRUEAXIS_MODEL)
/*
 Bytes of memory for a model.
 */
#define TRUEAXIS_MODEL_SIZE 40960
#endif

#if defined(TRUEAXIS_MODEL)
/*
 The same in words of 8 bytes.
 */
#define TRUEAXIS_MODEL_WORDS 5120
#endif

/*
 What a function returns: 0, or why it did nothing. `trueaxis_result_text` says it in words.
 */
enum trueaxis_result
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /*
     Done.
     */
    TRUEAXIS_RESULT_OK = 0,
    /*
     A pointer is null.
     */
    TRUEAXIS_RESULT_NULL_POINTER = 1,
    /*
     The memory is too small, or does not start at a multiple of the alignment.
     */
    TRUEAXIS_RESULT_MEMORY = 2,
    /*
     The servo was released.
     */
    TRUEAXIS_RESULT_RELEASED = 3,
    /*
     A servo holds these tables, or another thread loads them.
     */
    TRUEAXIS_RESULT_IN_USE = 4,
    /*
     Nothing is loaded.
     */
    TRUEAXIS_RESULT_NOT_LOADED = 5,
    /*
     An array has not as many values as there are axes.
     */
    TRUEAXIS_RESULT_COUNT = 6,
    /*
     There is none of this number.
     */
    TRUEAXIS_RESULT_INDEX = 7,
    /*
     There is none of this name.
     */
    TRUEAXIS_RESULT_NAME = 8,
    /*
     The bytes are no blob (`.trax`).
     */
    TRUEAXIS_RESULT_NOT_A_BLOB = 9,
    /*
     The blob has a format version that this library does not know.
     */
    TRUEAXIS_RESULT_VERSION = 10,
    /*
     The bytes are damaged or incomplete: wrong length or checksum.
     */
    TRUEAXIS_RESULT_DAMAGED = 11,
    /*
     The blob does not start at a multiple of 4 bytes.
     */
    TRUEAXIS_RESULT_MISALIGNED = 12,
    /*
     The blob needs more than this library holds.
     */
    TRUEAXIS_RESULT_CAPACITY = 13,
    /*
     The contents of the blob are not valid.
     */
    TRUEAXIS_RESULT_CONTENTS = 14,
    /*
     The previous change of tables is not finished.
     */
    TRUEAXIS_RESULT_BUSY = 15,
    /*
     The axes differ in number, order, letter, travel or period.
     */
    TRUEAXIS_RESULT_OTHER_AXES = 16,
    /*
     The auxiliary inputs differ in number, kind, name or reference.
     */
    TRUEAXIS_RESULT_OTHER_AUXILIARIES = 17,
    /*
     This term does not exist or has a fixed weight.
     */
    TRUEAXIS_RESULT_WEIGHT_FIXED = 18,
    /*
     The weight is not a number, or not within the limits of the term.
     */
    TRUEAXIS_RESULT_WEIGHT_LIMITS = 19,
    /*
     The common factor or a fade is on its way: there is no one correction to take out.
     */
    TRUEAXIS_RESULT_MOVING = 20,
    /*
     A mistake in this library: please report it. The object must not be used any more.
     */
    TRUEAXIS_RESULT_BROKEN = 21,
    /*
     The bytes are no machine model, as `trueaxis linuxcnc model` writes it.
     */
    TRUEAXIS_RESULT_NOT_A_MODEL = 22,
    /*
     The program was compiled with the header of another version of this library.
     */
    TRUEAXIS_RESULT_HEADER_VERSION = 23,
    /*
     The header has another `TRUEAXIS_AXES` than the library was built with.
     */
    TRUEAXIS_RESULT_HEADER_AXES = 24,
    /*
     The header has another `TRUEAXIS_BANKS` than the library was built with.
     */
    TRUEAXIS_RESULT_HEADER_BANKS = 25,
    /*
     The header has another `TRUEAXIS_TABLES` than the library was built with.
     */
    TRUEAXIS_RESULT_HEADER_TABLES = 26,
    /*
     The header has another `TRUEAXIS_TERMS` than the library was built with.
     */
    TRUEAXIS_RESULT_HEADER_TERMS = 27,
    /*
     The header has another `TRUEAXIS_GRIDS` than the library was built with.
     */
    TRUEAXIS_RESULT_HEADER_GRIDS = 28,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum trueaxis_result trueaxis_result;
#else
typedef int32_t trueaxis_result;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

#if defined(TRUEAXIS_MODEL)
/*
 A model: a machine with its errors. Points of measured motions stay in the file.
 */
typedef struct trueaxis_model trueaxis_model;
#endif

/*
 A servo: it holds tables and corrects.
 */
typedef struct trueaxis_servo trueaxis_servo;

/*
 Tables: a compensation that was loaded. Its samples stay in the blob.
 */
typedef struct trueaxis_tables trueaxis_tables;

#if defined(TRUEAXIS_MODEL)
/*
 Where the tool is, seen from the workpiece.
 */
typedef struct trueaxis_model_pose_facts {
    /*
     The tip of the tool as it is, with all errors at the positions (mm).
     */
    double tip[3];
    /*
     Unit vector from there to the spindle.
     */
    double direction[3];
    /*
     The tip as it should be, without errors at the commands (mm).
     */
    double nominal_tip[3];
    /*
     Unit vector from there to the spindle.
     */
    double nominal_direction[3];
} trueaxis_model_pose_facts;
#endif

/*
 What held in the last period.
 */
typedef struct trueaxis_status {
    /*
     `TRUEAXIS_BAD_INPUT` …; `trueaxis_conditions_text` says them in words.
     */
    uint16_t conditions;
    /*
     Axes (bit 0 is the first) whose computed correction met the value bound.
     */
    uint16_t saturated;
    /*
     Axes whose correction is behind because of the rate bound.
     */
    uint16_t rate_limited;
    /*
     Axes whose correction would leave the travel.
     */
    uint16_t travel_limited;
    /*
     The common factor, 0…1.
     */
    float factor;
} trueaxis_status;

/*
 What was loaded.
 */
typedef struct trueaxis_facts {
    /*
     Bytes of the blob.
     */
    uint32_t bytes;
    /*
     Its checksum: with the length it tells blobs apart.
     */
    uint32_t checksum;
    /*
     Its format version.
     */
    uint16_t version;
    /*
     Number of axes.
     */
    uint16_t axes;
    /*
     Number of auxiliary inputs.
     */
    uint16_t auxiliaries;
    /*
     Number of adjustable terms.
     */
    uint16_t adjustable;
    /*
     Number of tables.
     */
    uint16_t tables;
    /*
     Number of terms.
     */
    uint16_t terms;
    /*
     Number of grids.
     */
    uint16_t grids;
    /*
     What the rotary axes are corrected for: `TRUEAXIS_ORIENTATION`, `TRUEAXIS_DIRECTION` or
     `TRUEAXIS_POSITION`.
     */
    uint8_t policy;
    /*
     0.
     */
    uint8_t reserved;
    /*
     One bit per axis (bit 0 is the first) on whose position a correction depends, then one per
     auxiliary input.
     */
    uint32_t inputs_used;
} trueaxis_facts;

/*
 An axis: an input and an output of the tables.
 */
typedef struct trueaxis_axis {
    /*
     Its letter.
     */
    char name;
    /*
     Unit of its positions and corrections: `TRUEAXIS_DEGREES` for A, B and C, otherwise `TRUEAXIS_MM`.
     */
    uint8_t unit;
    /*
     0.
     */
    uint16_t reserved;
    /*
     Lower end of its travel; −FLT_MAX without one.
     */
    float lower;
    /*
     Upper end of its travel; FLT_MAX without one.
     */
    float upper;
    /*
     The turn of an axis without end; 0 for others.
     */
    float turn;
    /*
     Largest magnitude of its correction.
     */
    float value_bound;
    /*
     Largest rate of change of its correction, per s.
     */
    float rate_bound;
    /*
     Rate of change of its correction in transitions, per s.
     */
    float ramp_rate;
    /*
     Retreat after which it counts as reversed.
     */
    float hysteresis;
} trueaxis_axis;

/*
 An auxiliary input.
 */
typedef struct trueaxis_auxiliary {
    /*
     The length for which the tables were made, mm; the reference of the temperature, °C.
     */
    float reference;
    /*
     `TRUEAXIS_TOOL_LENGTH` or `TRUEAXIS_TEMPERATURE`.
     */
    uint8_t kind;
    /*
     Its name, UTF-8, with a zero at the end.
     */
    char name[TRUEAXIS_NAME_SIZE];
} trueaxis_auxiliary;

/*
 A term whose weight may be set.
 */
typedef struct trueaxis_adjustable {
    /*
     Its number among all terms, which `trueaxis_servo_set_weight` takes.
     */
    uint32_t term;
    /*
     Number of the axis that it corrects.
     */
    uint32_t axis;
    /*
     Its weight as stored.
     */
    float weight;
    /*
     Lowest weight.
     */
    float lower;
    /*
     Highest weight.
     */
    float upper;
} trueaxis_adjustable;

/*
 Memory for tables, for a `static` or wherever there is room.
 */
typedef struct trueaxis_tables_memory {
    /*
     Nothing of the caller's.
     */
    uint64_t words[TRUEAXIS_TABLES_WORDS];
} trueaxis_tables_memory;

/*
 Memory for a servo, for a `static` or wherever there is room.
 */
typedef struct trueaxis_servo_memory {
    /*
     Nothing of the caller's.
     */
    uint64_t words[TRUEAXIS_SERVO_WORDS];
} trueaxis_servo_memory;

#if defined(TRUEAXIS_MODEL)
/*
 Memory for a model, for a `static` or wherever there is room.
 */
typedef struct trueaxis_model_memory {
    /*
     Nothing of the caller's.
     */
    uint64_t words[TRUEAXIS_MODEL_WORDS];
} trueaxis_model_memory;
#endif

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

#if defined(TRUEAXIS_MODEL)
/*
 Makes a model, empty, in `memory` of `size` bytes, and writes where it is to `made`. A model plays a real
 machine: it says where the tool is with known errors. The memory stays where it is; nothing needs to be
 given back. `header` is `TRUEAXIS_HEADER`, as for `trueaxis_tables_new`.

 # Safety
 `memory` has `size` bytes.
 */
trueaxis_result trueaxis_model_new(uint64_t header, void *memory, size_t size, struct trueaxis_model **made);
#endif

#if defined(TRUEAXIS_MODEL)
/*
 Loads the bytes of a file that `trueaxis linuxcnc model` has written, at a multiple of 8 bytes. Measured
 values are read where they are: the bytes stay there and as they are until another file is loaded. If it
 is refused nothing is loaded. Not for a real-time thread.

 # Safety
 `file` has `length` bytes, which stay.
 */
trueaxis_result trueaxis_model_load(struct trueaxis_model *model, const void *file, size_t length);
#endif

#if defined(TRUEAXIS_MODEL)
/*
 Writes the letters of the axes in order, `YXZ`: at most `size` bytes with the zero at the end. Returns how
 many there are; 0 if nothing is loaded.

 # Safety
 `text` has room for `size` bytes.
 */
size_t trueaxis_model_axes(struct trueaxis_model *model, char *text, size_t size);
#endif

#if defined(TRUEAXIS_MODEL)
/*
 Where the tool is, seen from the workpiece: as it is, with all errors at `positions`, and as it should be,
 without errors at `commands`; both of `count` axes in the order of the model, in mm and degrees. The
 directions of travel, for backlash, are those of the commands from call to call. `tool_length` is in mm
 along the tool axis from the spindle frame; NAN for the machine's own tool. `celsius` has `sensors`
 temperatures in the order of the error file; those that are missing are at their reference. Meant to be
 called in a real-time thread: no heap, no lock, no system call.

 # Safety
 The arrays have so many values, `pose` has room.
 */
trueaxis_result trueaxis_model_pose(struct trueaxis_model *model,
                                    const double *commands,
                                    const double *positions,
                                    size_t count,
                                    double tool_length,
                                    const double *celsius,
                                    size_t sensors,
                                    struct trueaxis_model_pose_facts *pose);
#endif

/*
 Bytes that a servo takes on this system: at most `TRUEAXIS_SERVO_SIZE`.
 */
size_t trueaxis_servo_size(void);

/*
 Makes a servo with these tables, disabled, in `memory` of `size` bytes, and writes where it is to `made`.
 It holds the tables from now on, until they have retired or it is released.

 # Safety
 `memory` has `size` bytes, and no servo that has not been released is there.
 */
trueaxis_result trueaxis_servo_new(void *memory,
                                   size_t size,
                                   struct trueaxis_tables *tables,
                                   struct trueaxis_servo **made);

/*
 Ends a servo: it holds no tables any more, and its memory is the caller's again. The corrections are gone
 at once; disable it before and go on until the factor is 0 where that matters. Calls with this pointer are
 refused (`TRUEAXIS_RESULT_RELEASED`) as long as nothing else is written to the memory.

 # Safety
 No other thread uses it.
 */
trueaxis_result trueaxis_servo_release(struct trueaxis_servo *servo);

/*
 One period, in the real-time thread. `commands`: the *uncorrected* commands in machine coordinates, mm
 and degrees, one for each of the `axes` axes, which must be as many as the tables have; axes without end
 may have any number of turns. `referenced`: bit 0 for the first axis, cleared while it is not referenced
 or is homing. `period`: of this call, s. To `corrections` it writes what is to be *added* to the commands;
 that may be the array of the commands. After any other result than `TRUEAXIS_RESULT_OK` those are not written.

 Faults of the inputs are no such result: see `trueaxis_servo_status`.

 # Safety
 The arrays have so many values; no other thread uses the servo.
 */
trueaxis_result trueaxis_servo_update(struct trueaxis_servo *servo,
                                      const double *commands,
                                      size_t axes,
                                      uint32_t referenced,
                                      double period,
                                      double *corrections);

/*
 As `trueaxis_servo_update`, in single precision throughout, for processors that compute doubles in
 software. The positions of axes without end are within a turn, or some few beyond: a float of many turns is
 coarse, and beyond 2¹³ of them it is a bad input. The corrections are those of `trueaxis_servo_update` for
 the same positions, to the last bit.

 # Safety
 The arrays have so many values; no other thread uses the servo.
 */
trueaxis_result trueaxis_servo_update_f32(struct trueaxis_servo *servo,
                                          const float *commands,
                                          size_t axes,
                                          uint32_t referenced,
                                          float period,
                                          float *corrections);

/*
 Lets the corrections in (`on` not 0) or takes them out, all by one common factor, over some time. In
 every period if one likes: what changes nothing costs nothing.

 # Safety
 No other thread uses it.
 */
trueaxis_result trueaxis_servo_enable(struct trueaxis_servo *servo, int32_t on);

/*
 Begins (`on` not 0) or ends a dry run: everything is computed and reported, the corrections go to zero.

 # Safety
 No other thread uses it.
 */
trueaxis_result trueaxis_servo_dry_run(struct trueaxis_servo *servo, int32_t on);

/*
 Sets an auxiliary input by its number: a tool length in mm, a temperature in °C (its reference is
 subtracted here). It holds from the next update on, and is faded in. What was never set, or is not a
 number because its sensor is lost, is a fault if a correction depends on it, never 0.

 # Safety
 No other thread uses it.
 */
trueaxis_result trueaxis_servo_set_auxiliary(struct trueaxis_servo *servo, size_t index, double value);

/*
 Sets the tool length, mm; `TRUEAXIS_RESULT_NAME` if the tables have no such input.

 # Safety
 No other thread uses it.
 */
trueaxis_result trueaxis_servo_set_tool_length(struct trueaxis_servo *servo, double length);

/*
 Sets the weight of an adjustable term of the tables last accepted; it is faded in.

 # Safety
 No other thread uses it.
 */
trueaxis_result trueaxis_servo_set_weight(struct trueaxis_servo *servo, size_t term, double weight);

/*
 The weight asked for of an adjustable term of the tables last accepted.

 # Safety
 No other thread uses it; `weight` has room.
 */
trueaxis_result trueaxis_servo_weight(const struct trueaxis_servo *servo, size_t term, double *weight);

/*
 Says in which direction an axis last moved (1 positive, −1 negative, 0 not known), where the controller
 knows: after homing, which ends with a move in a known direction.

 # Safety
 No other thread uses it.
 */
trueaxis_result trueaxis_servo_set_travel(struct trueaxis_servo *servo, size_t axis, int32_t direction);

/*
 Fades over to other tables of the same axes and auxiliary inputs, with their stored weights, as soon as
 nothing else moves. The servo holds both until that is done; then `trueaxis_servo_take_retired` gives
 those before back. To those in use: only their stored weights are faded in.

 Tables that had retired before and were not taken back come back here in `retired` (null: none), whatever
 the result; `retired` itself may be null. If it is not aligned nothing happens at all.

 # Safety
 No other thread uses the servo; `retired` has room if it is not null.
 */
trueaxis_result trueaxis_servo_swap(struct trueaxis_servo *servo,
                                    struct trueaxis_tables *to,
                                    struct trueaxis_tables **retired);

/*
 Gives the tables back that were in use before the last change, once that is finished: others can be loaded
 into them. Given once; null if there are none.

 # Safety
 No other thread uses it; `retired` has room.
 */
trueaxis_result trueaxis_servo_take_retired(struct trueaxis_servo *servo, struct trueaxis_tables **retired);

/*
 Measurement mode: from positions where the axes stand (a touch probe, the scales) to the commands that
 lead there, the correction taken out as far as it is in. Directions of travel, weights and auxiliary
 inputs are those of the last update. `TRUEAXIS_RESULT_MOVING` while something is ramped or faded: then subtract
 the correction of the period in question. Four evaluations. The arrays may be the same.

 # Safety
 The arrays have so many values; no other thread uses the servo.
 */
trueaxis_result trueaxis_servo_measured(const struct trueaxis_servo *servo,
                                        const double *measured,
                                        size_t axes,
                                        double *commands);

/*
 What held in the last period.

 # Safety
 No other thread uses it; `status` has room.
 */
trueaxis_result trueaxis_servo_status(const struct trueaxis_servo *servo, struct trueaxis_status *status);

/*
 The corrections of the last period as computed, within the value bounds, before the common factor,
 travel and rate bounds: what a dry run would give.

 # Safety
 No other thread uses it; `computed` has room for so many values.
 */
trueaxis_result trueaxis_servo_computed(const struct trueaxis_servo *servo, double *computed, size_t axes);

/*
 How fast the corrections changed in the last period, mm/s and degrees/s: to be added to the velocity
 where drives take one as feed-forward.

 # Safety
 No other thread uses it; `velocity` has room for so many values.
 */
trueaxis_result trueaxis_servo_velocity(const struct trueaxis_servo *servo, double *velocity, size_t axes);

/*
 Writes conditions in words (`bad input, held`), as `trueaxis_tables_reason` does.

 # Safety
 `text` has room for `size` bytes.
 */
size_t trueaxis_conditions_text(uint16_t conditions, char *text, size_t size);

/*
 A result in words: English, UTF-8, never null, for ever.
 */
const char *trueaxis_result_text(int32_t result);

/*
 Bytes that tables take on this system: at most `TRUEAXIS_TABLES_SIZE`.
 */
size_t trueaxis_tables_size(void);

/*
 Makes tables, empty, in `memory` of `size` bytes, and writes where they are to `made`. The memory is
 theirs until the program has no more use for them, and stays where it is; nothing needs to be given back.
 What was in it does not matter.

 `header` is `TRUEAXIS_HEADER`: a program that was compiled with the header of another version, or for
 other capacities than the library, is refused (`TRUEAXIS_RESULT_HEADER_…`) before anything is written.

 # Safety
 `memory` has `size` bytes, and no servo holds tables there.
 */
trueaxis_result trueaxis_tables_new(uint64_t header,
                                    void *memory,
                                    size_t size,
                                    struct trueaxis_tables **made);

/*
 Loads a blob: the bytes of a file `.trax`, at a multiple of 4 bytes. Its samples are read where they are:
 it stays there and as it is until other tables are loaded here. Everything is checked before a servo can
 take it. Takes as long as the blob has bytes: not for a real-time thread.

 If it is refused nothing is loaded, and `trueaxis_tables_reason` says why.

 # Safety
 `blob` has `length` bytes, which stay.
 */
trueaxis_result trueaxis_tables_load(struct trueaxis_tables *tables, const void *blob, size_t length);

/*
 As `trueaxis_tables_load`, from a place of `size` bytes in flash: bytes after the blob are ignored.

 # Safety
 `slot` has `size` bytes, which stay.
 */
trueaxis_result trueaxis_tables_load_slot(struct trueaxis_tables *tables, const void *slot, size_t size);

/*
 As `trueaxis_tables_load`, of a copy: the blob may be anywhere and is not needed any more afterwards. The
 copy goes to `copy`, which has `size` bytes, at least as many as the blob, at a multiple of 4; it stays
 there and as it is until other tables are loaded here.

 # Safety
 `blob` has `length` bytes and `copy` has `size`.
 */
trueaxis_result trueaxis_tables_load_copy(struct trueaxis_tables *tables,
                                          const void *blob,
                                          size_t length,
                                          void *copy,
                                          size_t size);

/*
 Writes why the last blob was refused, with what it has and what would be right: at most `size` bytes
 with the zero at the end. Returns the length of the whole text without the zero; 0 if nothing was
 refused. `text` may be null if `size` is 0.

 # Safety
 `text` has room for `size` bytes.
 */
size_t trueaxis_tables_reason(const struct trueaxis_tables *tables, char *text, size_t size);

/*
 Writes the name of the machine, as `trueaxis_tables_reason` does.

 # Safety
 `text` has room for `size` bytes.
 */
size_t trueaxis_tables_machine(const struct trueaxis_tables *tables, char *text, size_t size);

/*
 What was loaded.

 # Safety
 `facts` has room for it.
 */
trueaxis_result trueaxis_tables_facts(const struct trueaxis_tables *tables, struct trueaxis_facts *facts);

/*
 Axis `index`, from 0. Positions and corrections are in the order of the axes.

 # Safety
 `axis` has room for it.
 */
trueaxis_result trueaxis_tables_axis(const struct trueaxis_tables *tables,
                                     size_t index,
                                     struct trueaxis_axis *axis);

/*
 The number of the axis with this letter.

 # Safety
 `index` has room for it.
 */
trueaxis_result trueaxis_tables_find_axis(const struct trueaxis_tables *tables, char name, size_t *index);

/*
 Auxiliary input `index`, from 0.

 # Safety
 `auxiliary` has room for it.
 */
trueaxis_result trueaxis_tables_auxiliary(const struct trueaxis_tables *tables,
                                          size_t index,
                                          struct trueaxis_auxiliary *auxiliary);

/*
 The number of the auxiliary input with this name.

 # Safety
 `name` ends with a zero; `index` has room.
 */
trueaxis_result trueaxis_tables_find_auxiliary(const struct trueaxis_tables *tables,
                                               const char *name,
                                               size_t *index);

/*
 The term with an adjustable weight that is number `index` of them, from 0.

 # Safety
 `adjustable` has room for it.
 */
trueaxis_result trueaxis_tables_adjustable(const struct trueaxis_tables *tables,
                                           size_t index,
                                           struct trueaxis_adjustable *adjustable);

/*
 What memory for tables and servos is aligned to: `TRUEAXIS_ALIGNMENT`.
 */
size_t trueaxis_alignment(void);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* TRUEAXIS_H */

#ifndef TRUEAXIS_CHECKED
#define TRUEAXIS_CHECKED
/* What the library relies on. */
#ifdef __cplusplus
#define TRUEAXIS_ASSERT(name, holds) static_assert(holds, #name)
#define TRUEAXIS_ALIGN_OF(type) alignof(type)
#elif defined(__STDC_VERSION__) && __STDC_VERSION__ >= 201112L
#define TRUEAXIS_ASSERT(name, holds) _Static_assert(holds, #name)
#define TRUEAXIS_ALIGN_OF(type) _Alignof(type)
#else
#define TRUEAXIS_ASSERT(name, holds) typedef char trueaxis_##name[(holds) ? 1 : -1]
#define TRUEAXIS_ALIGN_OF(type) offsetof(struct { char first; type second; }, second)
#endif
TRUEAXIS_ASSERT(doubles_have_8_bytes, sizeof(double) == 8);
TRUEAXIS_ASSERT(floats_have_4_bytes, sizeof(float) == 4);
TRUEAXIS_ASSERT(memory_for_tables_is_large, sizeof(trueaxis_tables_memory) == TRUEAXIS_TABLES_SIZE);
TRUEAXIS_ASSERT(memory_for_a_servo_is_large, sizeof(trueaxis_servo_memory) == TRUEAXIS_SERVO_SIZE);
TRUEAXIS_ASSERT(memory_is_aligned, TRUEAXIS_ALIGN_OF(trueaxis_tables_memory) % TRUEAXIS_ALIGNMENT == 0);
TRUEAXIS_ASSERT(facts_have_28_bytes, sizeof(trueaxis_facts) == 28);
TRUEAXIS_ASSERT(axes_have_32_bytes, sizeof(trueaxis_axis) == 32);
TRUEAXIS_ASSERT(auxiliaries_have_24_bytes, sizeof(trueaxis_auxiliary) == 24);
TRUEAXIS_ASSERT(adjustable_terms_have_20_bytes, sizeof(trueaxis_adjustable) == 20);
TRUEAXIS_ASSERT(status_has_12_bytes, sizeof(trueaxis_status) == 12);
#undef TRUEAXIS_ASSERT
#undef TRUEAXIS_ALIGN_OF
#endif
