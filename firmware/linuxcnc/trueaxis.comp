// SPDX-License-Identifier: MIT
// Copyright (c) 2026 The trueaxis maintainers. The licence is in LICENSE-MIT.
component trueaxis "Volumetric compensation of a machine tool, at servo rate";

description """
Adds a correction for the geometric errors of the machine to the command of each joint, and removes it from the
feedback again, so that the motion controller, its displays, limits and probing see uncorrected positions.
The compensation is a file made by the program \\fBtrueaxis\\fR. It may depend on the positions of all axes, on
the tool length and on temperatures; all joints are corrected together.

.B trueaxis.read
runs before \\fBmotion\\-controller\\fR and removes the correction of the last period from the feedback;
.B trueaxis.write
runs after it and adds the new one. Corrections change only with bounded rate and acceleration: enabling,
disabling, homing, faults and new files never cause a step.

If the file is missing, damaged or for another machine, LinuxCNC still starts: the outputs equal the inputs,
\\fBfault\\fR is true, \\fBfault\\-code\\fR gives the kind of fault, and the log explains it. A rising edge of
\\fBreload\\fR reads the same file again. While \\fBenable\\fR and \\fBactive\\fR are false, any file that fits the
joints is accepted. Otherwise it must have the same axes, travels and inputs, and the corrections fade over to it.
If it is not accepted, the previous compensation stays in use, with \\fBfault\\fR true.
""";

examples """
.nf
loadrt trueaxis file=/home/cnc/machine.trax axes=XYZAC units=mm
addf trueaxis.read             servo\\-thread
addf motion\\-command\\-handler  servo\\-thread
addf motion\\-controller        servo\\-thread
addf trueaxis.write            servo\\-thread

# for each joint N; before: joint.N.motor\\-pos\\-cmd to the drive, its feedback to joint.N.motor\\-pos\\-fb
net N\\-pos       joint.N.pos\\-cmd           => trueaxis.joint.N.pos\\-in
net N\\-homed     joint.N.homed             => trueaxis.joint.N.homed
net N\\-homing    joint.N.homing            => trueaxis.joint.N.homing
net N\\-cmd       joint.N.motor\\-pos\\-cmd     => trueaxis.joint.N.motor\\-cmd\\-in
net N\\-drive     trueaxis.joint.N.motor\\-cmd\\-out  => (the drive)
net N\\-scale     (the feedback)            => trueaxis.joint.N.motor\\-fb\\-in
net N\\-fb        trueaxis.joint.N.motor\\-fb\\-out   => joint.N.motor\\-pos\\-fb

net tool\\-length motion.tooloffset.z       => trueaxis.tool\\-length
setp trueaxis.enable 0          # the operator switches the corrections on
.fi
""";

notes """
.SS States
The first that applies; a changed state shows in the same period.
.nf
 0  active: the corrections are in
 1  \\fBenable\\fR is off
 2  a dry run
 3  a joint is not homed: \\fBwaiting\\-for\\fR is its number
 4  a joint is homing: \\fBwaiting\\-for\\fR is its number
 5  a fault: see \\fBfault\\-code\\fR
 6  the corrections are fading in
 7  no file has been read yet
.fi
.SS Fault codes
.nf
 0  none
 1  the file cannot be read
 2  the file is damaged, has another format, or exceeds the capacities of this component
 3  its axes differ from \\fBaxes=\\fR
 4  it needs more temperature pins than there are
 5  it was not accepted while corrections are active, because its axes, travels or inputs differ
 6  \\fBpos\\-in\\fR of a joint is not connected, or not a number
 7  \\fBtool\\-length\\fR is not connected, or not a number
 8  a temperature is not connected, or not a number
 9  a weight is outside its limits
10  the period of the thread is outside 1 µs to 10 ms
11  a position is out of reach, or a temperature is implausible
12  a bug in the library: please report it
.fi
.SS Unconnected pins
\\fBpos\\-in\\fR, \\fBtool\\-length\\fR, \\fBtemperature\\-N\\fR and \\fBweight\\-N\\fR are not a number (shown as \\fBnan\\fR)
until they are connected or set. If a correction depends on one of the first three, that is a fault; they never
count as 0. A signal without a writer counts as connected.
.SS Real time
Files are read by a separate thread, which is not a real\\-time thread.
.SS Licence
The source of this component is under the MIT licence. Combined with LinuxCNC it is a work under the GNU General
Public License, version 2.
""";
see_also """\\fBmotion\\fR(9), https://docs.rs/trueaxis""";
author "The trueaxis maintainers";
license "Dual MIT/GPL";

// Joints, temperatures and weights are counted in EXTRA_SETUP, 5 bits each.
pin in  float joint.#.pos_in[16 : personality & 31] = NAN "Uncorrected position of the joint: from joint.N.pos\\-cmd, never from joint.N.motor\\-pos\\-cmd, which contains backlash and homing offset";
pin in  bit   joint.#.homed[16 : personality & 31] "From joint.N.homed";
pin in  bit   joint.#.homing[16 : personality & 31] "From joint.N.homing";
pin in  float joint.#.motor_cmd_in[16 : personality & 31] "From joint.N.motor\\-pos\\-cmd";
pin out float joint.#.motor_cmd_out[16 : personality & 31] "motor\\-cmd\\-in with the correction added: to the drive";
pin in  float joint.#.motor_fb_in[16 : personality & 31] "Feedback of the drive, or motor\\-cmd\\-out without one";
pin out float joint.#.motor_fb_out[16 : personality & 31] "motor\\-fb\\-in with the correction of the last period removed: to joint.N.motor\\-pos\\-fb";
pin out float joint.#.correction[16 : personality & 31] "The added correction, in machine units";
pin out float joint.#.computed[16 : personality & 31] "The correction with factor 1, in machine units: also while disabled or in a dry run. Updated for one joint per period, in turn";
pin out float joint.#.bound_used[16 : personality & 31] "computed as a fraction of the largest correction of its axis, 0 to 1; updated together with it";

pin in  bit   enable "Ramps the corrections in or out";
pin in  bit   dry_run "Everything is computed and shown, while the corrections ramp to 0";
pin in  bit   reload "A rising edge reads the file again";
pin out bit   loading "A file is being read, or is waiting to be used";
pin out bit   fading "The corrections are fading over to another file";
pin out unsigned loads "Number of files accepted";
pin out unsigned reloads "Number of rising edges of reload that have been answered: load\\-fault says how";
pin out unsigned checksum "Checksum of the file in use, which identifies it; 0 without a file";
pin out bit   active "Corrections are applied, at least partly";
pin out float factor "The fade factor of all corrections, 0 to 1";
pin out unsigned state = 7 "Why the corrections are not in, or 0: see NOTES";
pin out signed waiting_for = -1 "The joint that must be homed before the corrections come in, or \\-1";
pin out bit   saturated "A correction is limited to the largest of its axis";
pin out bit   beyond_range "A temperature is outside of the range that was measured: its effect stays what it is at the border";
pin out bit   fault "There is a fault: see fault\\-code";
pin out unsigned fault_code "The kind of fault: see NOTES";
pin out unsigned load_fault "The kind of fault for which the last file was not accepted; 0 if it was. fault\\-code is the same unless there is another fault";
pin in  float tool_length = NAN "From motion.tooloffset.z, in machine units";
pin in  float temperature_#[8 : (personality >> 5) & 31] = NAN "Temperatures in °C, in the order of the file";
pin in  float weight_#[16 : (personality >> 10) & 31] = NAN "Weights of the adjustable terms, in the order of the file; until set, those stored in the file";

modparam dummy file "Path of the compensation, FILE.trax; if missing, that is a fault, and nothing is corrected";
modparam dummy axes "Letter of the axis of each joint, from joint 0, as in the file: XYZAC. XYYZ is a gantry: both joints get the correction of Y, at the position of the first one. \\- is a joint without correction";
modparam dummy units "Linear units of the machine: mm, metric, inch, in or imperial, as [TRAJ]LINEAR_UNITS. There is no default";
modparam dummy temperatures "Number of temperature pins (0)";
modparam dummy weights "Number of weight pins (0)";

function read_ "Removes the correction of the last period from the feedback: before motion\\-controller";
function write_ "Adds the new correction to the commands: after motion\\-controller";

option singleton yes;
option extra_setup yes;
option extra_cleanup yes;
include <math.h>;
include "cycle.h";
;;

static char *file = "";
RTAPI_MP_STRING(file, "path of the compensation");
static char *axes = "";
RTAPI_MP_STRING(axes, "letter of the axis of each joint");
static char *units = "";
RTAPI_MP_STRING(units, "linear units of the machine");
static int temperatures = 0;
RTAPI_MP_INT(temperatures, "number of temperature pins");
static int weights = 0;
RTAPI_MP_INT(weights, "number of weight pins");

static struct cycle now;
static bool reload_before;

/* Pins written only when they change, because they are in separate memory that the processor would otherwise fetch
 * in every period. They are also written in turn, one per period, for pins that are connected while HAL runs. */
static struct {
    float in;
    unsigned taken, sum, code, of_file, answers;
    bool acting, cut_off, beyond, busy, fades;
    enum reason why;
    int awaited;
    unsigned turn;
} shown = {.why = STATE_LOADING, .awaited = -1};
#define TURNS 8
#define SHOW(number, pin, last, value) \
    do { \
        if ((last) != (value) || shown.turn == (number)) \
            (pin) = (last) = (value); \
    } while (0)

EXTRA_SETUP()
{
    int joints = loading_configure(file, axes, units, temperatures, weights);
    (void)prefix;
    (void)extra_arg;
    if (joints < 0)
        return joints;
    personality = joints | temperatures << 5 | weights << 10;
    return loading_start();
}

EXTRA_CLEANUP()
{
    loading_stop();
}

FUNCTION(read_)
{
    (void)period;
    for (int j = 0; j < configured.joints; j++)
        joint_motor_fb_out(j) = joint_motor_fb_in(j) - now.corrections[j];
}

FUNCTION(write_)
{
    enum trouble found;
    unsigned answers;
    bool asked;
    (void)period;
    for (int j = 0; j < configured.joints; j++) {
        now.position[j] = joint_pos_in(j);
        now.homed[j] = joint_homed(j);
        now.homing[j] = joint_homing(j);
    }
    for (int t = 0; t < configured.temperatures; t++)
        now.kelvin[t] = temperature(t);
    for (int w = 0; w < configured.weights; w++)
        now.wanted[w] = weight(w);
    now.length = tool_length;
    now.on = enable;
    now.dry = dry_run;
    asked = reload;
    if (asked && !reload_before)
        loading_ask();
    reload_before = asked;
    /* If nothing is being read now, `of_file` below is about the last file. */
    answers = loading_busy() ? shown.answers : loading_requests();

    found = run_cycle(&now, fperiod);

    for (int j = 0; j < configured.joints; j++) {
        joint_correction(j) = now.corrections[j];
        joint_motor_cmd_out(j) = joint_motor_cmd_in(j) + now.corrections[j];
    }
    joint_computed(now.shown) = now.would_be;
    joint_bound_used(now.shown) = now.share;
    shown.turn = (shown.turn + 1) % TURNS;
    SHOW(0, factor, shown.in, now.in);
    SHOW(1, active, shown.acting, now.in > 0);
    SHOW(2, saturated, shown.cut_off, now.cut_off);
    SHOW(2, beyond_range, shown.beyond, now.beyond);
    SHOW(3, loading, shown.busy, loading_busy());
    SHOW(3, fading, shown.fades, retiring);
    SHOW(4, loads, shown.taken, now.taken);
    SHOW(5, checksum, shown.sum, current != NULL ? current->sum : 0);
    SHOW(6, state, shown.why, now.why);
    SHOW(6, waiting_for, shown.awaited, now.awaited);
    if (shown.code != found || shown.turn == 7) {
        fault = found != TROUBLE_NONE;
        fault_code = shown.code = found;
        loading_report(found);
    }
    SHOW(7, load_fault, shown.of_file, now.of_file);
    SHOW(7, reloads, shown.answers, answers);
}
