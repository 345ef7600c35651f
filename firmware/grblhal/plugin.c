/* Functions called by grblHAL.
 *
 * SPDX-License-Identifier: MIT
 * Copyright (c) 2026 The trueaxis maintainers
 */
#include "cartesian.h"
#include "commands.h"
#include "compensation.h"
#include "motion.h"
#include "trueaxis_grblhal.h"

static on_execute_realtime_ptr on_execute_realtime;
static on_jog_cancel_ptr on_jog_cancel;
static on_probe_start_ptr on_probe_start;
static on_probe_completed_ptr on_probe_completed;
static on_report_options_ptr on_report_options;
static user_mcode_execute_ptr execute_mcode;

static void execute_realtime(sys_state_t state)
{
    txa_motion_watch();
    txa_watch_clock();
    on_execute_realtime(state);
}

/* Called from an interrupt. */
static void jog_cancel(sys_state_t state)
{
    txa_motion_cancel();
    if (on_jog_cancel != NULL)
        on_jog_cancel(state);
}

static bool probe_start(axes_signals_t axes, float *target, plan_line_data_t *data)
{
    txa_motion_probes(data);
    return on_probe_start == NULL || on_probe_start(axes, target, data);
}

static void probe_completed(void)
{
    txa_motion_probes(NULL);
    if (on_probe_completed != NULL)
        on_probe_completed();
}

static void report_options(bool newopt)
{
    on_report_options(newopt);
    if (!newopt)
        report_plugin("trueaxis", "0.1");
}

#ifndef TRUEAXIS_FLASH
static on_vfs_mount_ptr on_mount;

/* Called for a card inserted after the start. */
static void mount(const char *path, const vfs_t *fs, vfs_st_mode_t mode)
{
    if (on_mount != NULL)
        on_mount(path, fs, mode);
    if (!txa_present() && txa_motion_at_rest())
        txa_load_and_say();
}
#endif

/* Some kinematics are switched with an M-code. */
static void mcode(sys_state_t state, parser_block_t *block)
{
    execute_mcode(state, block);
    txa_motion_chain();
}

/* Runs once everything is initialised: grblHAL sets up its kinematics after the plugins. */
static void start(void *data)
{
    (void)data;
    txa_motion_chain();
    on_execute_realtime = grbl.on_execute_realtime;
    grbl.on_execute_realtime = execute_realtime;
    on_jog_cancel = grbl.on_jog_cancel;
    grbl.on_jog_cancel = jog_cancel;
    on_probe_start = grbl.on_probe_start;
    grbl.on_probe_start = probe_start;
    on_probe_completed = grbl.on_probe_completed;
    grbl.on_probe_completed = probe_completed;
    txa_motion_limits(true);
    if ((execute_mcode = grbl.user_mcode.execute) != NULL)
        grbl.user_mcode.execute = mcode;
    txa_load_and_say();
#ifndef TRUEAXIS_FLASH
    on_mount = vfs.on_mount;
    vfs.on_mount = mount;
#endif
}

void trueaxis_init(void)
{
    txa_cartesian(&kinematics);
    txa_motion_limits(false);
    on_report_options = grbl.on_report_options;
    grbl.on_report_options = report_options;
    txa_commands();
    task_run_on_startup(start, NULL);
}

#ifndef TRUEAXIS_NO_MY_PLUGIN
void my_plugin_init(void)
{
    trueaxis_init();
}
#endif
