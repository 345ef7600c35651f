/* A stand-in for the interface of grblHAL, to compile and test the plugin with: names, types and meaning as
 * in grblHAL, and only what the plugin uses. It is not part of grblHAL, and nothing of it is here. Comments name the
 * files of its core (August 2026) that a declaration follows.
 *
 * SPDX-License-Identifier: MIT
 * Copyright (c) 2026 The trueaxis maintainers
 */
#ifndef STANDIN_HAL_H
#define STANDIN_HAL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifndef N_AXIS
#define N_AXIS 6
#endif
#define KINEMATICS_API
#define MAX_FEED_RATE_OVERRIDE 200
#define MINIMUM_FEED_RATE 1.0f
#define MM_PER_INCH 25.4f
#define ASCII_EOL "\r\n"
#define On 1
#define Off 0
#define Z_AXIS 2
#define bit(n) (1UL << (n))
#define bit_istrue(x, mask) (((x) & (mask)) != 0)
#define CAPS(c) ((c) >= 'a' && (c) <= 'z' ? (c) - 'a' + 'A' : (c))

/* Axes and positions. */
typedef union {
    uint8_t mask;
    uint8_t bits;
} axes_signals_t;
typedef union {
    float values[N_AXIS];
} coord_data_t;
typedef union {
    int32_t values[N_AXIS];
} mpos_t;
extern char const *const axis_letter[N_AXIS];
char *ftoa(float n, uint8_t decimal_places);
char *uitoa(uint32_t n);

/* Settings: per axis steps/mm, mm/min and mm/min². */
typedef struct {
    struct {
        float steps_per_mm, max_rate, acceleration;
    } axis[N_AXIS];
    struct {
#if N_AXIS > 3 /* settings.h, stepper_settings_t */
        axes_signals_t is_rotary;
#endif
        uint16_t idle_lock_time;
    } steppers;
    struct {
        uint16_t rotary_fix_enable : 1, revert_metric_conversion : 1;
    } flags;
} settings_t;
extern settings_t settings;

/* The state of the machine. */
typedef uint_fast16_t sys_state_t;
#define STATE_IDLE 0
#define STATE_ALARM bit(0)
#define STATE_CHECK_MODE bit(1)
#define STATE_HOMING bit(2)
#define STATE_CYCLE bit(3)
#define STATE_HOLD bit(4)
#define STATE_JOG bit(5)
#define STATE_SAFETY_DOOR bit(6)
#define STATE_SLEEP bit(7)
#define STATE_ESTOP bit(8)
#define STATE_TOOL_CHANGE bit(9)
typedef struct {
    coord_data_t min, max;
} work_envelope_t;
typedef enum { Probing_Off = 0, Probing_Active } probing_state_t;
typedef struct {
    int32_t position[N_AXIS], probe_position[N_AXIS];
    axes_signals_t homed, soft_limits;
    axes_signals_t tlo_reference_set; /* axes with a reference tool */
    work_envelope_t work_envelope; /* of homed axes */
    volatile probing_state_t probing_state;
} system_t;
extern system_t sys;
sys_state_t state_get(void);
void limits_set_machine_positions(axes_signals_t cycle, bool add_pulloff);
void system_convert_array_steps_to_mpos(float *position, int32_t *steps);

/* The parser. */
typedef enum {
    ToolLengthOffset_Cancel = 0,
    ToolLengthOffset_Enable,
    ToolLengthOffset_EnableDynamic,
    ToolLengthOffset_ApplyAdditional
} tool_offset_mode_t;
typedef struct {
    struct {
        bool units_imperial;
        tool_offset_mode_t tool_offset_mode;
        float tool_length_offset[N_AXIS];
    } modal;
    float position[N_AXIS];
} parser_state_t;
extern parser_state_t gc_state;
typedef struct {
    uint16_t user_mcode;
} parser_block_t;

/* The planner. */
typedef struct {
    struct {
        uint16_t rapid_motion : 1, jog_motion : 1, no_feed_override : 1, inverse_time : 1, units_per_rev : 1, target_valid : 1,
            target_validated : 1;
    } condition;
    struct {
        struct {
            uint8_t synchronized : 1;
        } state;
    } spindle;
    float feed_rate, rate_multiplier;
} plan_line_data_t;
typedef struct plan_block {
    float target_mm[N_AXIS];
} plan_block_t;
float *plan_get_position(void);
plan_block_t *plan_get_current_block(void);
uint_fast16_t plan_get_buffer_size(void);
uint_fast16_t plan_get_block_buffer_available(void);
void plan_sync_position(void);
#define gc_sync_position() system_convert_array_steps_to_mpos(gc_state.position, sys.position)
#define sync_position()                                                                                               \
    plan_sync_position();                                                                                             \
    gc_sync_position()

/* Messages, commands, tasks. */
typedef enum {
    Status_OK = 0,
    Status_BadNumberFormat = 2,
    Status_InvalidStatement = 3,
    Status_IdleError = 8,
    Status_FileReadError = 61,
    Status_Unhandled = 255
} status_code_t;
typedef enum { Message_Plain = 0, Message_Info, Message_Warning } message_type_t;
void report_message(const char *msg, message_type_t type);
void report_plugin(const char *name, const char *version);
typedef status_code_t (*sys_command_ptr)(sys_state_t state, char *args);
typedef struct {
    const char *command;
    sys_command_ptr execute;
    union {
        uint8_t flags;
    } flags;
    union {
        const char *str;
    } help;
} sys_command_t;
typedef struct sys_commands_str {
    const uint8_t n_commands;
    const sys_command_t *commands;
    struct sys_commands_str *next;
} sys_commands_t;
void system_register_commands(sys_commands_t *commands);
typedef void (*foreground_task_ptr)(void *data);
bool task_run_on_startup(foreground_task_ptr fn, void *data);

/* Files. */
typedef struct {
    const void *fs;
    size_t size;
} vfs_file_t;
typedef struct {
    const char *fs_name;
} vfs_t;
typedef union {
    uint8_t mode;
} vfs_st_mode_t;
typedef void (*on_vfs_mount_ptr)(const char *path, const vfs_t *fs, vfs_st_mode_t mode);
typedef struct {
    on_vfs_mount_ptr on_mount;
} vfs_events_t;
extern vfs_events_t vfs;
vfs_file_t *vfs_open(const char *filename, const char *mode);
size_t vfs_read(void *buffer, size_t size, size_t count, vfs_file_t *file);
void vfs_close(vfs_file_t *file);

/* Entries. */
typedef bool (*travel_limits_ptr)(float *target, axes_signals_t axes, bool is_cartesian, work_envelope_t *envelope);
typedef bool (*on_probe_start_ptr)(axes_signals_t axes, float *target, plan_line_data_t *pl_data);
typedef void (*on_probe_completed_ptr)(void);
typedef void (*on_report_options_ptr)(bool newopt);
typedef void (*on_execute_realtime_ptr)(sys_state_t state);
typedef void (*on_jog_cancel_ptr)(sys_state_t state);
typedef void (*user_mcode_execute_ptr)(sys_state_t state, parser_block_t *gc_block);
typedef struct {
    on_report_options_ptr on_report_options;
    on_execute_realtime_ptr on_execute_realtime;
    on_jog_cancel_ptr on_jog_cancel;
    on_probe_start_ptr on_probe_start;
    on_probe_completed_ptr on_probe_completed;
    travel_limits_ptr check_travel_limits;
    struct {
        user_mcode_execute_ptr execute;
    } user_mcode;
} grbl_t;
extern grbl_t grbl;
typedef struct {
    struct {
        void (*write)(const char *s);
    } stream;
    uint32_t (*get_elapsed_ticks)(void); /* ms */
} grbl_hal_t;
extern grbl_hal_t hal;
void my_plugin_init(void);

#endif
