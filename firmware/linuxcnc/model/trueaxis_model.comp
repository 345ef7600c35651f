// SPDX-License-Identifier: MIT
// Copyright (c) 2026 The trueaxis maintainers. The licence is in LICENSE-MIT.
component trueaxis_model "Simulates the real machine: the tool position with known geometric errors";

description """
From the commands of the drives and of the motion controller, computes where the tool really is relative to the
workpiece, on a machine with known errors: several µm from its nominal position without a compensation, and almost
exactly there with one. The machine is a file made by
.RS
trueaxis linuxcnc model machine.toml errors.toml \\-o FILE
.RE
It is computed with exact kinematics, not with the tables of the compensation.

With \fBballs=\fR it also plays a touch probe: \fBtouching\fR goes to motion.probe\-input.

Add its function to the thread after all functions that write commands for the drives.
""";

examples """
.nf
loadrt trueaxis_model file=mill.model axes=XYZ units=mm
addf trueaxis\\-model servo\\-thread          # after trueaxis.write

# for each joint N; SIGNAL goes to its drive
net N\\-pos     joint.N.pos\\-cmd       => trueaxis\\-model.joint.N.pos\\-in
net SIGNAL                           => trueaxis\\-model.joint.N.motor\\-in
net N\\-offset  joint.N.motor\\-offset  => trueaxis\\-model.joint.N.motor\\-offset
.fi
""";

notes """
Each line of the file of \fBballs=\fR is a ball on the workpiece side: x, y and z of its centre in the workpiece frame of
the machine file, and its diameter, mm, separated by spaces. The centre of the stylus tip is the tip of the tool.

Directions of travel, for backlash, are those of \\fBpos\\-in\\fR with the reversal threshold of the machine file, as the
compensation does it. Temperatures act with the lags of the error file; a pin that is not connected leaves its temperature
at the reference.
""";
see_also """\\fBtrueaxis\\fR(9), https://docs.rs/trueaxis""";
author "The trueaxis maintainers";
license "Dual MIT/GPL";

// Joints and temperatures are counted in EXTRA_SETUP, 5 bits each.
pin in  float joint.#.pos_in[16 : personality & 31] = NAN "Uncorrected position of the joint: from joint.N.pos\\-cmd";
pin in  float joint.#.motor_in[16 : personality & 31] = NAN "Command to the drive of the joint, including the correction";
pin in  float joint.#.motor_offset[16 : personality & 31] "From joint.N.motor\\-offset: the offset between the two due to homing";
pin in  float stylus = 6 "Diameter of the stylus tip, mm";
pin in  float pretravel "Distance that the stylus moves on from the surface before the probe trips, µm";
pin in  float lobing "Amplitude of its change around the tool axis, with three lobes, µm";
pin in  float noise "Standard deviation of a touch, µm";
pin in  float moved "How far the first ball has been pushed along x, mm";
pin in  float drift "How fast all balls move along each axis of the workpiece, µm/h";
pin in  float temperature_#[8 : (personality >> 5) & 31] = NAN "Temperatures in °C, in the order in which the error file names sensors";
pin out bit   touching "The stylus has contact with a ball";
pin in  float tool_length = NAN "Tool length along its axis from the spindle frame, machine units; until set, that of the machine file";

pin out float error "Distance of the tool tip from its nominal position, µm";
pin out float error_x "Its component along x of the workpiece, µm";
pin out float error_y "Its component along y of the workpiece, µm";
pin out float error_z "Its component along z of the workpiece, µm";
pin out float direction_error "Angle between the tool axis and its nominal direction, µrad";
pin out float tip_x "Actual position of the tool tip along x, in the workpiece frame of the machine file, mm";
pin out float tip_y "The same along y, mm";
pin out float tip_z "The same along z, mm";
pin out float direction_x "Actual unit vector from the tip to the spindle, along x";
pin out float direction_y "The same along y";
pin out float direction_z "The same along z";
pin out bit   fault "There is no model, or a position is not a number: the other pins are 0";

modparam dummy file "Path of the model";
modparam dummy axes "Letter of the axis of each joint, from joint 0: XYZAC; of two joints with the same letter the first counts; \\- is a joint that is not an axis of the model";
modparam dummy units "Linear units of the machine: mm, metric, inch, in or imperial, as [TRAJ]LINEAR_UNITS. There is no default";

modparam dummy temperatures "Number of temperature pins (0)";
modparam dummy balls "Path of a file with balls for the stylus, one in each line";

function _;

option singleton yes;
option extra_setup yes;
option extra_cleanup yes;
include <math.h>;
include <stdint.h>;
include <stdio.h>;
include "file.h";
include "joints.h";
include "trueaxis.h";
;;

#define SAY(...) rtapi_print_msg(RTAPI_MSG_ERR, "trueaxis_model: " __VA_ARGS__)

static char *file = "";
RTAPI_MP_STRING(file, "path of the model");
static char *axes = "";
RTAPI_MP_STRING(axes, "letter of the axis of each joint");
static char *units = "";
RTAPI_MP_STRING(units, "linear units of the machine");

static char *balls = "";
RTAPI_MP_STRING(balls, "path of the balls");

static int temperatures = 0;
RTAPI_MP_INT(temperatures, "number of temperature pins");

/* A ball: its centre in the workpiece frame and its diameter, mm. */
struct ball {
    double centre[3], diameter;
};
#define MOST_BALLS 64
#define MOST_TEMPERATURES 8
static struct ball ball[MOST_BALLS];
static int ball_count;
/* How far this touch is off, µm; another one once the stylus is free. */
static double off_by;
static bool drawn;

static trueaxis_model_memory memory;
static trueaxis_model *model;
static void *bytes;
static double mm; /* in a linear unit of the machine */
static int count; /* of axes of the model; 0 without one */
static int joint_of[TRUEAXIS_AXES];
static double unit[TRUEAXIS_AXES]; /* mm or degrees in a unit of the machine */

/* Reads the file and loads it; says why not. */
static int load(void)
{
    char letters[TRUEAXIS_AXES + 1];
    trueaxis_result result;
    const char *why;
    size_t size;
    bytes = read_file(file, &size, &why);
    if (bytes == NULL) {
        SAY("file=%s: %s\n", file, why);
        return 0;
    }
    result = trueaxis_model_load(model, bytes, size);
    if (result != TRUEAXIS_RESULT_OK) {
        SAY("file=%s: %s\n", file, trueaxis_result_text(result));
        return 0;
    }
    int found = trueaxis_model_axes(model, letters, sizeof letters);
    for (int k = 0; k < found; k++) {
        const char *joint = strchr(axes, letters[k]);
        if (joint == NULL) {
            SAY("file=%s has an axis %c, for which axes=%s names no joint\n", file, letters[k], axes);
            return 0;
        }
        joint_of[k] = joint - axes;
        unit[k] = strchr("ABC", letters[k]) == NULL ? mm : 1.0;
    }
    return found;
}

/* Reads the balls; says why not. */
static bool load_balls(void)
{
    FILE *from = fopen(balls, "r");
    char line[256];
    if (from == NULL) {
        SAY("balls=%s: it cannot be read\n", balls);
        return false;
    }
    while (fgets(line, sizeof line, from) != NULL) {
        struct ball *b = &ball[ball_count];
        double *at = b->centre;
        if (line[strspn(line, " \t\r\n")] == '\0')
            continue;
        if (ball_count == MOST_BALLS ||
            sscanf(line, "%lf %lf %lf %lf", &at[0], &at[1], &at[2], &b->diameter) != 4 || !(b->diameter > 0)) {
            SAY("balls=%s: `%s` is not x, y, z and diameter of one of at most %d balls\n", balls, line, MOST_BALLS);
            fclose(from);
            return false;
        }
        ball_count++;
    }
    fclose(from);
    return true;
}

/* A random number, near enough to a normal distribution for noise: the sum of twelve uniform ones. */
static double drawn_at_random(void)
{
    static uint64_t last = 1;
    double sum = -6;
    for (int i = 0; i < 12; i++) {
        last = last * 6364136223846793005u + 1442695040888963407u;
        sum += (double)(last >> 11) / 9007199254740992.0;
    }
    return sum;
}

/* How far the centre of the stylus is inside the sphere on which it touches the nearest ball, mm, and how far the probe
 * trips inside it. */
static double inside(const double tip[3], const double direction[3], double tip_diameter, double trips, double lobes,
                     double pushed, double drifted)
{
    double deepest = -INFINITY;
    for (int b = 0; b < ball_count; b++) {
        double way[3], square = 0, along = 0, apart, least;
        for (int i = 0; i < 3; i++) {
            way[i] = tip[i] - ball[b].centre[i] - drifted - (b == 0 && i == 0 ? pushed : 0);
            square += way[i] * way[i];
            along += way[i] * direction[i];
        }
        apart = sqrt(square);
        /* The angle around the tool axis, from the x axis of the workpiece or, along it, from y. */
        double across[2][3], turn[2];
        int first = fabs(direction[0]) < 0.9 ? 0 : 1;
        for (int i = 0; i < 3; i++)
            across[0][i] = (i == first) - direction[first] * direction[i];
        for (int i = 0; i < 3; i++)
            across[1][i] = direction[(i + 1) % 3] * across[0][(i + 2) % 3] - direction[(i + 2) % 3] * across[0][(i + 1) % 3];
        for (int k = 0; k < 2; k++)
            turn[k] = way[0] * across[k][0] + way[1] * across[k][1] + way[2] * across[k][2];
        double sine = apart > 0 ? sqrt(fmax(0, 1 - along * along / square)) : 0;
        double lobe = sine * cos(3 * atan2(turn[1], turn[0]));
        least = (ball[b].diameter + tip_diameter) / 2 - (trips + lobes * lobe) * 1e-3;
        deepest = fmax(deepest, least - apart);
    }
    return deepest;
}

EXTRA_SETUP()
{
    int joints = joints_of(axes);
    trueaxis_result result;
    (void)prefix;
    (void)extra_arg;
    if (joints == 0) {
        SAY("axes=%s: write the letter of the axis of each joint, from joint 0, such as axes=XYZAC\n", axes);
        return -EINVAL;
    }
    mm = mm_of(units);
    if (mm == 0.0) {
        SAY("units=%s: write units=mm or units=inch, as [TRAJ]LINEAR_UNITS\n", units);
        return -EINVAL;
    }
    result = trueaxis_model_new(TRUEAXIS_HEADER, &memory, sizeof memory, &model);
    if (result != TRUEAXIS_RESULT_OK) {
        SAY("%s\n", trueaxis_result_text(result));
        return -EINVAL;
    }
    if (temperatures < 0 || temperatures > MOST_TEMPERATURES) {
        SAY("temperatures= is from 0 to %d\n", MOST_TEMPERATURES);
        return -EINVAL;
    }
    personality = joints | temperatures << 5;
    if (*balls != '\0' && !load_balls())
        return -EINVAL;
    /* Without a model LinuxCNC starts all the same, with `fault`. */
    count = load();
    return 0;
}

EXTRA_CLEANUP()
{
    free(bytes);
}

FUNCTION(_)
{
    double commands[TRUEAXIS_AXES], positions[TRUEAXIS_AXES], celsius[MOST_TEMPERATURES], off[3], across = 0;
    trueaxis_model_pose_facts pose = {{0}, {0}, {0}, {0}};
    bool right = count > 0;
    static double drifted; /* mm */
    for (int k = 0; k < count; k++) {
        int j = joint_of[k];
        commands[k] = joint_pos_in(j) * unit[k];
        positions[k] = (joint_motor_in(j) - joint_motor_offset(j)) * unit[k];
        right = right && isfinite(commands[k]) && isfinite(positions[k]);
    }
    for (int t = 0; t < temperatures; t++)
        celsius[t] = temperature(t);
    if (right && temperatures > 0)
        trueaxis_model_warm(model, celsius, temperatures, (double)period * 1e-9);
    right = right && trueaxis_model_pose(model, commands, positions, count, tool_length * mm, NULL, 0, &pose) ==
                         TRUEAXIS_RESULT_OK;
    fault = !right;
    for (int i = 0; i < 3; i++) {
        double apart = pose.direction[i] - pose.nominal_direction[i];
        off[i] = (pose.tip[i] - pose.nominal_tip[i]) * 1e3;
        across += apart * apart;
    }
    error = sqrt(off[0] * off[0] + off[1] * off[1] + off[2] * off[2]);
    error_x = off[0];
    error_y = off[1];
    error_z = off[2];
    /* The chord, which is the angle to 1e-9 of it below 0.2 mrad. */
    direction_error = sqrt(across) * 1e6;
    tip_x = pose.tip[0];
    tip_y = pose.tip[1];
    tip_z = pose.tip[2];
    direction_x = pose.direction[0];
    direction_y = pose.direction[1];
    direction_z = pose.direction[2];
    if (ball_count > 0) {
        double deep;
        drifted += drift * 1e-3 / 3600 * (double)period * 1e-9;
        deep = inside(pose.tip, pose.direction, stylus, pretravel, lobing, moved, drifted);
        if (!drawn)
            off_by = noise * drawn_at_random() * 1e-3;
        drawn = true;
        touching = right && deep > off_by;
        /* The next touch begins when this one has left the surface. */
        if (deep < -0.02)
            drawn = false;
    }
}
