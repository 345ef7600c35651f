/* trueaxis: volumetric compensation at servo rate. The manual: docs/src/c-interface.md
 *
 * SPDX-License-Identifier: MIT OR Apache-2.0
 *
 * No function allocates, waits or calls the operating system. All except `trueaxis_tables_load…` may be called
 * from a real-time thread. Objects live in memory of the caller, which must stay where it is:
 *
 *     static trueaxis_tables_memory memory;
 *     trueaxis_tables *tables;
 *     trueaxis_result result = trueaxis_tables_new(TRUEAXIS_HEADER, &memory, sizeof memory, &tables);
 *
 * A pointer to an object must be null or have been written by `trueaxis_…_new`; null is refused. The library
 * never reads memory that it has not written before, so the memory need not be cleared.
 *
 * Only one thread may use a servo at a time, and only one thread tables; other threads may query tables that
 * a servo holds. Tables are loaded by one thread and handed over to the servo's thread (by a queue, or a
 * pointer with release and acquire semantics).
 *
 * Positions and corrections are in mm and degrees, times in seconds. "Safety" lists the caller's obligations
 * that the library cannot check.
 */


#ifndef TRUEAXIS_H
#define TRUEAXIS_H

/* Written by cbindgen from firmware/capi/src: UPDATE_HEADER=1 cargo test -p trueaxis-capi --test header */

#include <stddef.h>
#include <stdint.h>

/* Capacities of the library. It was built with these numbers in environment variables of the same names;
 * `trueaxis_tables_new` refuses a program with other numbers. */
#ifndef TRUEAXIS_AXES
#define TRUEAXIS_AXES 8 /* axes */
#endif
#ifndef TRUEAXIS_BANKS
#define TRUEAXIS_BANKS 32 /* banks of tables */
#endif
#ifndef TRUEAXIS_TABLES
#define TRUEAXIS_TABLES 96 /* tables in all banks */
#endif
#ifndef TRUEAXIS_TERMS
#define TRUEAXIS_TERMS 256 /* terms */
#endif
#ifndef TRUEAXIS_GRIDS
#define TRUEAXIS_GRIDS 2 /* grids */
#endif

/* Version and capacities of this header, which `trueaxis_tables_new` compares with those of the library. */
#define TRUEAXIS_HEADER \
    ((uint64_t)TRUEAXIS_ABI << 56 | (uint64_t)TRUEAXIS_AXES << 48 | \
     (uint64_t)TRUEAXIS_BANKS << 40 | (uint64_t)TRUEAXIS_TABLES << 32 | \
     (uint64_t)TRUEAXIS_TERMS << 16 | (uint64_t)TRUEAXIS_GRIDS)


/*
 Incremented whenever a program built with an earlier header could fail.
 */
#define TRUEAXIS_ABI 4

/*
 Size of tables in words of 8 bytes: a fixed part, plus a part for each axis, bank, table, term and grid.
 */
#define TRUEAXIS_TABLES_WORDS (((((128 + (6 * TRUEAXIS_AXES)) + (12 * TRUEAXIS_BANKS)) + TRUEAXIS_TABLES) + ((5 * TRUEAXIS_TERMS) / 2)) + (34 * TRUEAXIS_GRIDS))

/*
 Size of tables in bytes.
 */
#define TRUEAXIS_TABLES_SIZE (8 * TRUEAXIS_TABLES_WORDS)

/*
 Size of a servo in words of 8 bytes: a fixed part, plus a part for each axis.
 */
#define TRUEAXIS_SERVO_WORDS (150 + (24 * TRUEAXIS_AXES))

/*
 Size of a servo in bytes.
 */
#define TRUEAXIS_SERVO_SIZE (8 * TRUEAXIS_SERVO_WORDS)

/*
 Required alignment of the memory for tables and servos in bytes.
 */
#define TRUEAXIS_ALIGNMENT 8

/*
 Maximum number of auxiliary inputs.
 */
#define TRUEAXIS_AUXILIARIES 8

/*
 Maximum number of adjustable terms.
 */
#define TRUEAXIS_ADJUSTABLE 16

/*
 Size of a name in bytes, including the terminating zero.
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
 Kind of auxiliary input: tool length, mm.
 */
#define TRUEAXIS_TOOL_LENGTH 0

/*
 Kind of auxiliary input: temperature, °C.
 */
#define TRUEAXIS_TEMPERATURE 1

/*
 Policy: rotary axes correct the orientation of the tool.
 */
#define TRUEAXIS_ORIENTATION 0

/*
 Policy: rotary axes correct the direction of the tool.
 */
#define TRUEAXIS_DIRECTION 1

/*
 Policy: rotary axes are not corrected.
 */
#define TRUEAXIS_POSITION 2

/*
 Condition: an input is NAN, infinite, or out of reach.
 */
#define TRUEAXIS_BAD_INPUT 1

/*
 Condition: the period is outside 1 µs to 10 ms.
 */
#define TRUEAXIS_BAD_PERIOD (1 << 1)

/*
 Condition: an axis on which a correction depends is not referenced.
 */
#define TRUEAXIS_UNREFERENCED (1 << 2)

/*
 Condition: the computed correction is from an earlier period.
 */
#define TRUEAXIS_HELD (1 << 3)

/*
 Condition: after a fault or the loss of a reference, until the fade factor has reached 0.
 */
#define TRUEAXIS_FROZEN (1 << 4)

/*
 Condition: the fade factor is moving to 0 or 1.
 */
#define TRUEAXIS_RAMPING (1 << 5)

/*
 Condition: other tables, weights or auxiliaries are being faded in, or are waiting for that.
 */
#define TRUEAXIS_FADING (1 << 6)

/*
 Condition: not enabled.
 */
#define TRUEAXIS_DISABLED (1 << 7)

/*
 Condition: a dry run is active.
 */
#define TRUEAXIS_DRY_RUN (1 << 8)

/*
 Condition: a tool length or a temperature that matters was never set or is unusable.
 */
#define TRUEAXIS_BAD_AUXILIARY (1 << 9)

/*
 Condition: nothing is loaded, so nothing is corrected.
 */
#define TRUEAXIS_NOTHING_LOADED (1 << 10)

/*
 Condition: a temperature that matters is beyond its tables, so its effect stays what it is at the border.
 */
#define TRUEAXIS_BEYOND_RANGE (1 << 11)

#if defined(TRUEAXIS_MODEL)
/*
 Size of a model in bytes.
 */
#define TRUEAXIS_MODEL_SIZE 40960
#endif

#if defined(TRUEAXIS_MODEL)
/*
 Size of a model in words of 8 bytes.
 */
#define TRUEAXIS_MODEL_WORDS 5120
#endif

/*
 Result of a function: 0, or the reason why it did nothing. `trueaxis_result_text` gives it in words.
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
     A servo holds these tables, or another thread is loading them.
     */
    TRUEAXIS_RESULT_IN_USE = 4,
    /*
     Nothing is loaded.
     */
    TRUEAXIS_RESULT_NOT_LOADED = 5,
    /*
     The length of an array differs from the number of axes.
     */
    TRUEAXIS_RESULT_COUNT = 6,
    /*
     There is no item with this index.
     */
    TRUEAXIS_RESULT_INDEX = 7,
    /*
     There is no item with this name.
     */
    TRUEAXIS_RESULT_NAME = 8,
    /*
     The bytes are not a blob (`.trax`).
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
     The blob exceeds the capacities of this library.
     */
    TRUEAXIS_RESULT_CAPACITY = 13,
    /*
     The contents of the blob are not valid.
     */
    TRUEAXIS_RESULT_CONTENTS = 14,
    /*
     The previous change of tables is not complete.
     */
    TRUEAXIS_RESULT_BUSY = 15,
    /*
     The axes differ in number, order, letter, travel or period.
     */
    TRUEAXIS_RESULT_OTHER_AXES = 16,
    /*
     The auxiliary inputs differ in number, kind, name, reference or lag.
     */
    TRUEAXIS_RESULT_OTHER_AUXILIARIES = 17,
    /*
     This term does not exist or has a fixed weight.
     */
    TRUEAXIS_RESULT_WEIGHT_FIXED = 18,
    /*
     The weight is NAN or outside the limits of the term.
     */
    TRUEAXIS_RESULT_WEIGHT_LIMITS = 19,
    /*
     The fade factor is ramping or a fade is in progress: there is no single correction to remove.
     */
    TRUEAXIS_RESULT_MOVING = 20,
    /*
     A bug in this library: please report it. The object must not be used any more.
     */
    TRUEAXIS_RESULT_BROKEN = 21,
    /*
     The bytes are not a machine model as written by `trueaxis linuxcnc model`.
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
    /*
     The generated code was compiled with fused, reordered or wider floating-point operations: it does not give the
     bits of the compensation.
     */
    TRUEAXIS_RESULT_OTHER_BITS = 29,
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
 A servo: it holds tables and computes corrections.
 */
typedef struct trueaxis_servo trueaxis_servo;

/*
 Tables: a loaded compensation. Its samples stay in the blob.
 */
typedef struct trueaxis_tables trueaxis_tables;

#if defined(TRUEAXIS_MODEL)
/*
 Position of the tool relative to the workpiece.
 */
typedef struct trueaxis_model_pose_facts {
    /*
     The actual tip of the tool, with all errors at the positions (mm).
     */
    double tip[3];
    /*
     Unit vector from the actual tip to the spindle.
     */
    double direction[3];
    /*
     The nominal tip, without errors at the commands (mm).
     */
    double nominal_tip[3];
    /*
     Unit vector from the nominal tip to the spindle.
     */
    double nominal_direction[3];
} trueaxis_model_pose_facts;
#endif

/*
 Status of the last period.
 */
typedef struct trueaxis_status {
    /*
     Conditions, `TRUEAXIS_BAD_INPUT` …; `trueaxis_conditions_text` gives them in words.
     */
    uint16_t conditions;
    /*
     Axes (bit 0 is the first) whose computed correction reached the value bound.
     */
    uint16_t saturated;
    /*
     Axes whose correction lags because of the rate bound.
     */
    uint16_t rate_limited;
    /*
     Axes whose correction would leave the travel.
     */
    uint16_t travel_limited;
    /*
     The fade factor, 0…1.
     */
    float factor;
} trueaxis_status;

/*
 A compensation as code: what `trueaxis generate --servo` writes.
 */
typedef struct trueaxis_generated {
    /*
     Axes, bounds, auxiliary inputs and weights as a blob without samples, aligned to 4 bytes.
     */
    const void *facts;
    /*
     Length in bytes.
     */
    size_t size;
    /*
     The code. `corrections` has room for one value per axis.
     */
    void (*evaluate)(const float *positions,
                     const float *auxiliaries,
                     const int8_t *travel,
                     const float *weights,
                     float *corrections);
    /*
     1 if the code gives the bits of the compensation as it was compiled.
     */
    int (*check)(void);
    /*
     Length in bytes of the blob from which it was generated.
     */
    uint32_t bytes;
    /*
     Checksum of that blob.
     */
    uint32_t checksum;
} trueaxis_generated;

/*
 Information about loaded tables.
 */
typedef struct trueaxis_facts {
    /*
     Length of the blob in bytes; of generated code that of the blob from which it was generated.
     */
    uint32_t bytes;
    /*
     CRC-32; together with the length it identifies a blob.
     */
    uint32_t checksum;
    /*
     Version of the blob format.
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
     Number of tables; generated code has its tables within it, and here one for each bank.
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
     What the rotary axes correct: `TRUEAXIS_ORIENTATION`, `TRUEAXIS_DIRECTION` or `TRUEAXIS_POSITION`.
     */
    uint8_t policy;
    /*
     Always 0.
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
     Letter of the axis.
     */
    char name;
    /*
     Unit of its positions and corrections: `TRUEAXIS_DEGREES` for A, B and C, otherwise `TRUEAXIS_MM`.
     */
    uint8_t unit;
    /*
     Always 0.
     */
    uint16_t reserved;
    /*
     Lower end of its travel; −FLT_MAX if it has none.
     */
    float lower;
    /*
     Upper end of its travel; FLT_MAX if it has none.
     */
    float upper;
    /*
     Length of one turn of an endless axis; 0 for others.
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
     How far it must come back to count as reversed.
     */
    float reversal_threshold;
    /*
     Largest rate of change of its correction while it makes up a reversal, per s.
     */
    float reversal_rate;
    /*
     Largest acceleration of its correction meanwhile, per s².
     */
    float reversal_acceleration;
} trueaxis_axis;

/*
 An auxiliary input.
 */
typedef struct trueaxis_auxiliary {
    /*
     The tool length for which the tables were made, mm, or the reference temperature, °C.
     */
    float reference;
    /*
     Lowest plausible reading of a temperature, °C; one below is a fault of the input.
     */
    float lowest;
    /*
     Highest plausible reading of a temperature, °C; one above is a fault of the input.
     */
    float highest;
    /*
     How fast a temperature is followed, K/s.
     */
    float rate;
    /*
     `TRUEAXIS_TOOL_LENGTH` or `TRUEAXIS_TEMPERATURE`.
     */
    uint8_t kind;
    /*
     In UTF-8, terminated by a zero.
     */
    char name[TRUEAXIS_NAME_SIZE];
} trueaxis_auxiliary;

/*
 A term with an adjustable weight.
 */
typedef struct trueaxis_adjustable {
    /*
     Index among all terms, as used by `trueaxis_servo_set_weight`.
     */
    uint32_t term;
    /*
     Index of the axis that it corrects.
     */
    uint32_t axis;
    /*
     The weight that the blob stores.
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
 Memory for tables, in a `static` or anywhere else.
 */
typedef struct trueaxis_tables_memory {
    /*
     For use by the library only.
     */
    uint64_t words[TRUEAXIS_TABLES_WORDS];
} trueaxis_tables_memory;

/*
 Memory for a servo, in a `static` or anywhere else.
 */
typedef struct trueaxis_servo_memory {
    /*
     For use by the library only.
     */
    uint64_t words[TRUEAXIS_SERVO_WORDS];
} trueaxis_servo_memory;

#if defined(TRUEAXIS_MODEL)
/*
 Memory for a model, in a `static` or anywhere else.
 */
typedef struct trueaxis_model_memory {
    /*
     For use by the library only.
     */
    uint64_t words[TRUEAXIS_MODEL_WORDS];
} trueaxis_model_memory;
#endif

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

#if defined(TRUEAXIS_MODEL)
/*
 Makes an empty model in `memory` of `size` bytes, and writes its address to `made`. A model simulates a real
 machine: it computes the position of the tool with known errors. The memory must stay where it is; nothing needs to
 be freed. `header` is `TRUEAXIS_HEADER`, as for `trueaxis_tables_new`.

 # Safety
 `memory` has `size` bytes.
 */
trueaxis_result trueaxis_model_new(uint64_t header,
                                   void *memory,
                                   size_t size,
                                   struct trueaxis_model **made);
#endif

#if defined(TRUEAXIS_MODEL)
/*
 Loads the contents of a file written by `trueaxis linuxcnc model`, aligned to 8 bytes. Measured values are read in
 place: the bytes must stay there unchanged until another file is loaded. If the file is refused, nothing is loaded.
 Not for a real-time thread.

 # Safety
 `file` has `length` bytes, which stay in place.
 */
trueaxis_result trueaxis_model_load(struct trueaxis_model *model,
                                    const void *file,
                                    size_t length);
#endif

#if defined(TRUEAXIS_MODEL)
/*
 Writes the letters of the axes in order, `YXZ`: at most `size` bytes including the terminating zero. Returns the
 number of letters; 0 if nothing is loaded.

 # Safety
 `text` has room for `size` bytes.
 */
size_t trueaxis_model_axes(struct trueaxis_model *model,
                           char *text,
                           size_t size);
#endif

#if defined(TRUEAXIS_MODEL)
/*
 Lets the errors of a model follow temperatures for `seconds`, each with the lag of the error file: the next
 `trueaxis_model_pose` without temperatures has them. `celsius` has `sensors` temperatures in the order in which the
 error file names sensors; NAN, or a missing one, leaves a temperature as it is, at first at its reference. Suitable
 for a real-time thread.

 # Safety
 The array has this many values.
 */
trueaxis_result trueaxis_model_warm(struct trueaxis_model *model,
                                    const double *celsius,
                                    size_t sensors,
                                    double seconds);
#endif

#if defined(TRUEAXIS_MODEL)
/*
 The position of the tool relative to the workpiece: the actual one, with all errors at `positions`, and the nominal
 one, without errors at `commands`. Both arrays have `count` axes in the order of the model, in mm and degrees. The
 directions of travel, for backlash, follow the commands from call to call. `tool_length` is in mm along the tool
 axis from the spindle frame; NAN selects the machine's own tool. `celsius` has `sensors` temperatures in the order in
 which the error file names sensors, which act at once; missing ones are taken at their reference. Without any
 (`sensors` 0), the temperatures are those of `trueaxis_model_warm`. Suitable for a real-time thread: no heap, no
 lock, no system call.

 # Safety
 The arrays have this many values, `pose` has room for one.
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
 Size of a servo on this system in bytes: at most `TRUEAXIS_SERVO_SIZE`.
 */
size_t trueaxis_servo_size(void);

/*
 Makes a disabled servo with these tables in `memory` of `size` bytes, and writes its address to `made`. It holds the
 tables until they are retired or the servo is released.

 # Safety
 `memory` has `size` bytes, and contains no servo that has not been released.
 */
trueaxis_result trueaxis_servo_new(void *memory,
                                   size_t size,
                                   struct trueaxis_tables *tables,
                                   struct trueaxis_servo **made);

/*
 Ends a servo: it no longer holds tables, and its memory belongs to the caller again. The corrections disappear at
 once; if that matters, disable it first and keep updating until the factor is 0. Further calls with this pointer are
 refused (`TRUEAXIS_RESULT_RELEASED`) as long as the memory is not overwritten.

 # Safety
 No other thread uses it.
 */
trueaxis_result trueaxis_servo_release(struct trueaxis_servo *servo);

/*
 One period, in the real-time thread. `commands`: the *uncorrected* commands in machine coordinates, mm and degrees,
 one for each of the `axes` axes, whose number must be that of the tables; endless axes may have any number of turns.
 `referenced`: bit 0 for the first axis, cleared while it is not referenced or is homing. `period`: of this call, s.
 The values to be *added* to the commands are written to `corrections`, which may be the same array as `commands`.
 They are written only if the result is `TRUEAXIS_RESULT_OK`.

 Faults of the inputs do not change the result: see `trueaxis_servo_status`.

 # Safety
 The arrays have this many values; no other thread uses the servo.
 */
trueaxis_result trueaxis_servo_update(struct trueaxis_servo *servo,
                                      const double *commands,
                                      size_t axes,
                                      uint32_t referenced,
                                      double period,
                                      double *corrections);

/*
 Like `trueaxis_servo_update`, in single precision throughout, for processors without double-precision hardware. Keep
 the positions of endless axes within one turn or a few: a float with many turns is coarse, and more than 2¹³ turns
 are a bad input. The corrections equal those of `trueaxis_servo_update` for the same positions in every bit.

 # Safety
 The arrays have this many values; no other thread uses the servo.
 */
trueaxis_result trueaxis_servo_update_f32(struct trueaxis_servo *servo,
                                          const float *commands,
                                          size_t axes,
                                          uint32_t referenced,
                                          float period,
                                          float *corrections);

/*
 Ramps the corrections in (`on` not 0) or out, all by one fade factor. May be called in every period: a call that
 changes nothing costs nothing.

 # Safety
 No other thread uses it.
 */
trueaxis_result trueaxis_servo_enable(struct trueaxis_servo *servo,
                                      int32_t on);

/*
 Begins (`on` not 0) or ends a dry run: everything is computed and reported, while the corrections go to zero.

 # Safety
 No other thread uses it.
 */
trueaxis_result trueaxis_servo_dry_run(struct trueaxis_servo *servo, int32_t on);

/*
 Begins again as after `trueaxis_servo_new`, for a controller whose positions are set anew while nothing moves (after
 homing): every correction is zero at once, no axis is referenced, no direction of travel is known. What was switched
 on stays on, and so do the weights and the temperatures with their lags. Tables that were waiting are in use.

 # Safety
 No other thread uses it.
 */
trueaxis_result trueaxis_servo_restart(struct trueaxis_servo *servo);

/*
 Time (s) in which nothing is updated: temperatures are followed for so long, at most 10 s in a call, and corrections stay
 as they are. For a controller that updates while it plans a move, at the periods of that move: what passes in
 addition, at standstill or because the move is slower, has to be told.

 # Safety
 No other thread uses it.
 */
trueaxis_result trueaxis_servo_pass_time(struct trueaxis_servo *servo,
                                         double time);

/*
 Sets an auxiliary input by its index: a tool length in mm, or a temperature in °C (its reference is subtracted
 here). Inputs with the same name, one sensor with several lags, are set together; the servo applies the lags. Takes
 effect at the next update, and is faded in. An input that was never set, or is NAN because its sensor
 has failed, is a fault if a correction depends on it; it never counts as 0.

 # Safety
 No other thread uses it.
 */
trueaxis_result trueaxis_servo_set_auxiliary(struct trueaxis_servo *servo,
                                             size_t index,
                                             double value);

/*
 Sets the tool length, mm; `TRUEAXIS_RESULT_NAME` if the tables have no such input.

 # Safety
 No other thread uses it.
 */
trueaxis_result trueaxis_servo_set_tool_length(struct trueaxis_servo *servo, double length);

/*
 Sets the weight of an adjustable term of the tables accepted last; the change is faded in.

 # Safety
 No other thread uses it.
 */
trueaxis_result trueaxis_servo_set_weight(struct trueaxis_servo *servo, size_t term, double weight);

/*
 The requested weight of an adjustable term of the tables accepted last.

 # Safety
 No other thread uses it; `weight` has room for one value.
 */
trueaxis_result trueaxis_servo_weight(const struct trueaxis_servo *servo, size_t term, double *weight);

/*
 Sets the direction in which an axis last moved (1 positive, −1 negative, 0 unknown), if the controller knows it:
 homing, for example, ends with a move in a known direction.

 # Safety
 No other thread uses it.
 */
trueaxis_result trueaxis_servo_set_travel(struct trueaxis_servo *servo,
                                          size_t axis,
                                          int32_t direction);

/*
 Fades over to other tables with the same axes and auxiliary inputs, with their stored weights, as soon as nothing
 else is changing. The servo holds both until that is complete; then `trueaxis_servo_take_retired` returns the
 previous ones. If `to` is already in use, only its stored weights are faded in.

 Tables that were retired earlier and not taken back are returned in `retired` (null: none), whatever the result;
 `retired` itself may be null. If it is misaligned, nothing happens at all.

 # Safety
 No other thread uses the servo; `retired` has room for a pointer if it is not null.
 */
trueaxis_result trueaxis_servo_swap(struct trueaxis_servo *servo,
                                    struct trueaxis_tables *to,
                                    struct trueaxis_tables **retired);

/*
 Returns the tables that were in use before the last change, once that is complete, so that others can be loaded into
 them. Returned once; null if there are none.

 # Safety
 No other thread uses it; `retired` has room for a pointer.
 */
trueaxis_result trueaxis_servo_take_retired(struct trueaxis_servo *servo,
                                            struct trueaxis_tables **retired);

/*
 Measurement mode: converts measured axis positions (a touch probe, the scales) to the commands that lead there,
 removing the correction to the extent that it is in. Uses the directions of travel, weights, tool length and
 temperatures (as they were followed) of the last update. Returns `TRUEAXIS_RESULT_MOVING` during a ramp or fade: subtract the correction of the period in
 question instead. Takes four evaluations. The arrays may be the same.

 # Safety
 The arrays have this many values; no other thread uses the servo.
 */
trueaxis_result trueaxis_servo_measured(const struct trueaxis_servo *servo,
                                        const double *measured,
                                        size_t axes,
                                        double *commands);

/*
 Status of the last period.

 # Safety
 No other thread uses it; `status` has room for one.
 */
trueaxis_result trueaxis_servo_status(const struct trueaxis_servo *servo, struct trueaxis_status *status);

/*
 The computed corrections of the last period, within the value bounds, before the fade factor, travel and rate
 bounds: what a dry run would apply.

 # Safety
 No other thread uses it; `computed` has room for this many values.
 */
trueaxis_result trueaxis_servo_computed(const struct trueaxis_servo *servo, double *computed, size_t axes);

/*
 Rate of change of the corrections in the last period, mm/s and degrees/s. Add it to the velocity for drives that
 take velocity feed-forward.

 # Safety
 No other thread uses it; `velocity` has room for this many values.
 */
trueaxis_result trueaxis_servo_velocity(const struct trueaxis_servo *servo,
                                        double *velocity,
                                        size_t axes);

/*
 Writes conditions in words (`bad input, held`), as `trueaxis_tables_reason` does.

 # Safety
 `text` has room for `size` bytes.
 */
size_t trueaxis_conditions_text(uint16_t conditions, char *text, size_t size);

/*
 A result in words: English, UTF-8, never null, valid for ever.
 */
const char *trueaxis_result_text(int32_t result);

/*
 Size of tables on this system in bytes: at most `TRUEAXIS_TABLES_SIZE`.
 */
size_t trueaxis_tables_size(void);

/*
 Makes empty tables in `memory` of `size` bytes, and writes their address to `made`. The memory belongs to them for
 as long as the program uses them, and must stay where it is; nothing needs to be freed. Its previous contents do not
 matter.

 `header` is `TRUEAXIS_HEADER`: a program compiled with the header of another version, or for other capacities than
 the library, is refused (`TRUEAXIS_RESULT_HEADER_…`) before anything is written.

 # Safety
 `memory` has `size` bytes, and no servo holds tables there.
 */
trueaxis_result trueaxis_tables_new(uint64_t header,
                                    void *memory,
                                    size_t size,
                                    struct trueaxis_tables **made);

/*
 Loads a blob: the contents of a `.trax` file, aligned to 4 bytes. Its samples are read in place, so it must stay
 there unchanged until other tables are loaded here. Everything is checked before a servo can use it. The time is
 proportional to the length of the blob: not for a real-time thread.

 If the blob is refused nothing is loaded, and `trueaxis_tables_reason` gives the reason.

 # Safety
 `blob` has `length` bytes, which stay in place.
 */
trueaxis_result trueaxis_tables_load(struct trueaxis_tables *tables,
                                     const void *blob,
                                     size_t length);

/*
 Like `trueaxis_tables_load`, from a region of `size` bytes in flash: bytes after the blob are ignored.

 # Safety
 `slot` has `size` bytes, which stay in place.
 */
trueaxis_result trueaxis_tables_load_slot(struct trueaxis_tables *tables, const void *slot, size_t size);

/*
 Like `trueaxis_tables_load`, using a copy: the blob may have any alignment and is not needed afterwards. The copy
 goes to `copy`, which has `size` bytes, at least as many as the blob, aligned to 4; it must stay there unchanged
 until other tables are loaded here.

 # Safety
 `blob` has `length` bytes and `copy` has `size`.
 */
trueaxis_result trueaxis_tables_load_copy(struct trueaxis_tables *tables,
                                          const void *blob,
                                          size_t length,
                                          void *copy,
                                          size_t size);

/*
 Like `trueaxis_tables_load`, for generated code: `trueaxis generate --servo` writes the code and a
 `trueaxis_generated` into one file. A servo with these tables calls the code instead of reading tables; its
 corrections are the same to the last bit; code that a compiler made otherwise is refused
 (`TRUEAXIS_RESULT_OTHER_BITS`). Not for a real-time thread.

 # Safety
 `generated` is as it was generated; its facts and code stay in place.
 */
trueaxis_result trueaxis_tables_load_generated(struct trueaxis_tables *tables,
                                               const struct trueaxis_generated *generated);

/*
 Writes the reason why the last blob was refused, with the value found and the value required: at most `size` bytes
 including the terminating zero. Returns the length of the whole text without the zero; 0 if nothing was refused, and
 while tables are loaded. `text` may be null if `size` is 0.

 # Safety
 `text` has room for `size` bytes.
 */
size_t trueaxis_tables_reason(const struct trueaxis_tables *tables,
                              char *text,
                              size_t size);

/*
 Writes the name of the machine, like `trueaxis_tables_reason`.

 # Safety
 `text` has room for `size` bytes.
 */
size_t trueaxis_tables_machine(const struct trueaxis_tables *tables, char *text, size_t size);

/*
 Information about the loaded tables.

 # Safety
 `facts` has room for one.
 */
trueaxis_result trueaxis_tables_facts(const struct trueaxis_tables *tables, struct trueaxis_facts *facts);

/*
 Axis `index`, from 0. Positions and corrections are in the order of the axes.

 # Safety
 `axis` has room for one.
 */
trueaxis_result trueaxis_tables_axis(const struct trueaxis_tables *tables,
                                     size_t index,
                                     struct trueaxis_axis *axis);

/*
 The index of the axis with this letter.

 # Safety
 `index` has room for one.
 */
trueaxis_result trueaxis_tables_find_axis(const struct trueaxis_tables *tables, char name, size_t *index);

/*
 Auxiliary input `index`, from 0.

 # Safety
 `auxiliary` has room for one.
 */
trueaxis_result trueaxis_tables_auxiliary(const struct trueaxis_tables *tables,
                                          size_t index,
                                          struct trueaxis_auxiliary *auxiliary);

/*
 The index of the auxiliary input with this name.

 # Safety
 `name` is terminated by a zero; `index` has room for one.
 */
trueaxis_result trueaxis_tables_find_auxiliary(const struct trueaxis_tables *tables,
                                               const char *name,
                                               size_t *index);

/*
 The adjustable term number `index` among the adjustable terms, from 0.

 # Safety
 `adjustable` has room for one.
 */
trueaxis_result trueaxis_tables_adjustable(const struct trueaxis_tables *tables,
                                           size_t index,
                                           struct trueaxis_adjustable *adjustable);

/*
 Required alignment of the memory for tables and servos in bytes: `TRUEAXIS_ALIGNMENT`.
 */
size_t trueaxis_alignment(void);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* TRUEAXIS_H */

#ifndef TRUEAXIS_CHECKED
#define TRUEAXIS_CHECKED
/* Assumptions of the library. */
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
TRUEAXIS_ASSERT(axes_have_40_bytes, sizeof(trueaxis_axis) == 40);
TRUEAXIS_ASSERT(auxiliaries_have_36_bytes, sizeof(trueaxis_auxiliary) == 36);
TRUEAXIS_ASSERT(adjustable_terms_have_20_bytes, sizeof(trueaxis_adjustable) == 20);
TRUEAXIS_ASSERT(status_has_12_bytes, sizeof(trueaxis_status) == 12);
#undef TRUEAXIS_ASSERT
#undef TRUEAXIS_ALIGN_OF
#endif
