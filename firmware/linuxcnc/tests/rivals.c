/* SPDX-License-Identifier: MIT
 *
 * For tests only: alternatives to the tables, timed in the same thread and run.
 *
 * rivals.matrix: the correction of the machine in examples/linuxcnc-xyzac-trt, computed from the matrices of all
 * axes and errors in every period, with one least-squares step, as in firmware/boards/stm32f405/bench/src/rivals/htm.rs.
 * Its errors are constants, whose matrices are computed once. It is compiled like LinuxCNC's own components; in rivals_fast.c, as
 * `rivals_fast.matrix`, with the options of our component.
 * rivals.kins: the inverse kinematics of the motion controller's module, at the commanded position.
 * rivals.nothing: a function that does nothing: the thread's overhead for calling it and reading the clock.
 * rivals.pins-in, rivals.pins-out: only the pin reads and writes of the component.
 * rivals.work: without a motion controller, a few µs of computing in other memory in its place.
 */
#include "rtapi.h"
#include "rtapi_app.h"
#include "hal.h"
#include "kinematics.h"

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>

MODULE_LICENSE("Dual MIT/GPL");

#ifndef NAME
#define NAME "rivals"
#endif

enum { X, Y, Z, A, C, AXES };

static struct pins {
    hal_float_t *position[AXES], *pose[AXES], *correction[AXES], *joint[AXES];
    hal_float_t *command[AXES], *drive[AXES], *feedback[AXES], *back[AXES];
    hal_bit_t *homed[AXES], *homing[AXES];
} *pins;
static int component;

typedef struct { double at[4][4]; } matrix;

static const matrix IDENTITY = {{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}}};
static const double DEGREE = M_PI / 180.0;

static matrix times(const matrix *a, const matrix *b)
{
    matrix product;
    for (int i = 0; i < 4; i++)
        for (int k = 0; k < 4; k++)
            product.at[i][k] = a->at[i][0] * b->at[0][k] + a->at[i][1] * b->at[1][k] + a->at[i][2] * b->at[2][k] +
                               a->at[i][3] * b->at[3][k];
    return product;
}

static matrix inverse(const matrix *m)
{
    matrix found = IDENTITY;
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++)
            found.at[i][k] = m->at[k][i];
        found.at[i][3] = -(m->at[0][i] * m->at[0][3] + m->at[1][i] * m->at[1][3] + m->at[2][i] * m->at[2][3]);
    }
    return found;
}

static matrix shift(double x, double y, double z)
{
    matrix m = IDENTITY;
    m.at[0][3] = x;
    m.at[1][3] = y;
    m.at[2][3] = z;
    return m;
}

static matrix turn(int axis, double angle)
{
    matrix m = IDENTITY;
    int j = (axis + 1) % 3, k = (axis + 2) % 3;
    double s = sin(angle), c = cos(angle);
    m.at[j][j] = c;
    m.at[j][k] = -s;
    m.at[k][j] = s;
    m.at[k][k] = c;
    return m;
}

/* A small shift and rotation. */
static matrix error_of(double x, double y, double z, double a, double b, double c)
{
    matrix t = shift(x, y, z), r = turn(0, a), m;
    m = times(&t, &r);
    r = turn(1, b);
    m = times(&m, &r);
    r = turn(2, c);
    return times(&m, &r);
}

/* From the machine's frame: workpiece branch Y X A C, tool branch Z. */
static struct joint {
    int index;
    int direction;   /* 0…2: along or about x, y, z */
    int rotary;
    double sign;     /* of the command */
    double scale;    /* mm per mm */
    matrix relative, located;
} joints[AXES];
static matrix tip, tip_with; /* from Z, without and with the error of the spindle */

static void make_joint(int n, int index, int direction, int rotary, double sign, double scale, matrix relative,
                       matrix error)
{
    joints[n] = (struct joint){index, direction, rotary, sign, scale, relative, times(&relative, &error)};
}

static void make_machine(void)
{
    matrix spindle = error_of(0, 0, 0, 25e-6, 0, 0);
    make_joint(0, Y, 1, 0, -1, 30e-6, IDENTITY, IDENTITY);
    make_joint(1, X, 0, 0, -1, -45e-6, IDENTITY, error_of(0, 0, 0, 0, 0, 60e-6));
    make_joint(2, A, 0, 1, 1, 0, shift(200, 145, -280), error_of(0, 12e-3, 0, 0, 0, 80e-6));
    make_joint(3, C, 2, 1, 1, 0, shift(0, 5, -40), error_of(-18e-3, 0, 0, 0, 40e-6, 0));
    make_joint(4, Z, 2, 0, 1, 0, IDENTITY, error_of(0, 0, 0, 0, -35e-6, 0));
    tip = shift(0, 0, -100);
    tip_with = times(&spindle, &tip);
}

static matrix motion(const struct joint *joint, double q, double scale)
{
    double moved = joint->sign * q + scale * q;
    if (joint->rotary)
        return turn(joint->direction, moved * DEGREE);
    return shift(joint->direction == 0 ? moved : 0, joint->direction == 1 ? moved : 0,
                 joint->direction == 2 ? moved : 0);
}

/* Least squares for 6 equations in 5 unknowns, with Householder reflections. */
static void solve(double a[6][AXES], double b[6], double x[AXES])
{
    for (int k = 0; k < AXES; k++) {
        double norm = 0, v[6] = {0}, vv = 0;
        for (int i = k; i < 6; i++)
            norm += a[i][k] * a[i][k];
        norm = sqrt(norm);
        for (int i = k; i < 6; i++)
            v[i] = a[i][k];
        v[k] += a[k][k] > 0 ? norm : -norm;
        for (int i = k; i < 6; i++)
            vv += v[i] * v[i];
        if (vv == 0)
            continue;
        for (int c = k; c < AXES; c++) {
            double dot = 0;
            for (int i = k; i < 6; i++)
                dot += v[i] * a[i][c];
            for (int i = k; i < 6; i++)
                a[i][c] -= 2 * dot / vv * v[i];
        }
        double dot = 0;
        for (int i = k; i < 6; i++)
            dot += v[i] * b[i];
        for (int i = k; i < 6; i++)
            b[i] -= 2 * dot / vv * v[i];
    }
    for (int k = AXES - 1; k >= 0; k--) {
        double rest = b[k];
        for (int c = k + 1; c < AXES; c++)
            rest -= a[k][c] * x[c];
        x[k] = a[k][k] != 0 ? rest / a[k][k] : 0;
    }
}

static void direct(const double q[AXES], double dq[AXES])
{
    matrix nominal[2] = {IDENTITY, IDENTITY}, actual[2] = {IDENTITY, IDENTITY}, frames[AXES];
    matrix tool, from_tool, e, back;
    double jacobian[6][AXES] = {{0}}, twist[6];
    for (int n = 0; n < AXES; n++) {
        const struct joint *joint = &joints[n];
        int branch = joint->index == Z;
        matrix m = motion(joint, q[joint->index], 0), with = motion(joint, q[joint->index], joint->scale);
        nominal[branch] = times(&nominal[branch], &joint->relative);
        nominal[branch] = times(&nominal[branch], &m);
        actual[branch] = times(&actual[branch], &joint->located);
        actual[branch] = times(&actual[branch], &with);
        frames[joint->index] = nominal[branch];
    }
    tool = times(&nominal[1], &tip);
    from_tool = inverse(&tool);
    e = times(&from_tool, &nominal[0]);
    back = inverse(&actual[0]);
    e = times(&e, &back);
    e = times(&e, &actual[1]);
    e = times(&e, &tip_with);
    for (int i = 0; i < 3; i++)
        twist[i] = -e.at[i][3];
    twist[3] = -(e.at[2][1] - e.at[1][2]) / 2;
    twist[4] = -(e.at[0][2] - e.at[2][0]) / 2;
    twist[5] = -(e.at[1][0] - e.at[0][1]) / 2;
    for (int n = 0; n < AXES; n++) {
        const struct joint *joint = &joints[n];
        const matrix *frame = &frames[joint->index];
        double sign = joint->index == Z ? joint->sign : -joint->sign, along[3], arm[3], moved[3];
        for (int i = 0; i < 3; i++) {
            along[i] = sign * frame->at[i][joint->direction];
            arm[i] = tool.at[i][3] - frame->at[i][3];
            moved[i] = along[i];
        }
        if (joint->rotary) {
            moved[0] = along[1] * arm[2] - along[2] * arm[1];
            moved[1] = along[2] * arm[0] - along[0] * arm[2];
            moved[2] = along[0] * arm[1] - along[1] * arm[0];
        }
        for (int i = 0; i < 3; i++)
            for (int k = 0; k < 3; k++) {
                jacobian[i][joint->index] += from_tool.at[i][k] * moved[k];
                if (joint->rotary)
                    jacobian[3 + i][joint->index] += from_tool.at[i][k] * along[k];
            }
    }
    solve(jacobian, twist, dq);
    for (int k = 0; k < AXES; k++)
        dq[k] = k == A || k == C ? dq[k] / DEGREE : dq[k];
}

static void matrix_row(void *nothing, long period)
{
    double q[AXES], correction[AXES];
    (void)nothing;
    (void)period;
    for (int k = 0; k < AXES; k++)
        q[k] = *pins->position[k];
    direct(q, correction);
    for (int k = 0; k < AXES; k++)
        *pins->correction[k] = correction[k];
}

static void kins_row(void *nothing, long period)
{
    KINEMATICS_INVERSE_FLAGS inverse_flags = 0;
    KINEMATICS_FORWARD_FLAGS forward_flags = 0;
    double found[16] = {0};
    EmcPose pose;
    (void)nothing;
    (void)period;
    memset(&pose, 0, sizeof pose);
    pose.tran.x = *pins->pose[X];
    pose.tran.y = *pins->pose[Y];
    pose.tran.z = *pins->pose[Z];
    pose.a = *pins->pose[A];
    pose.c = *pins->pose[C];
    kinematicsInverse(&pose, found, &inverse_flags, &forward_flags);
    for (int k = 0; k < AXES; k++)
        *pins->joint[k] = found[k];
}

static void nothing_row(void *nothing, long period)
{
    (void)nothing;
    (void)period;
}

static void pins_in_row(void *nothing, long period)
{
    (void)nothing;
    (void)period;
    for (int k = 0; k < AXES; k++)
        *pins->back[k] = *pins->feedback[k];
}

static void pins_out_row(void *nothing, long period)
{
    (void)nothing;
    (void)period;
    for (int k = 0; k < AXES; k++) {
        bool referenced = *pins->homed[k] && !*pins->homing[k];
        *pins->drive[k] = *pins->command[k];
        *pins->correction[k] = referenced ? *pins->position[k] : 0;
    }
}

static void work_row(void *nothing, long period)
{
    static double state[512];
    (void)nothing;
    (void)period;
    for (int round = 0; round < 4; round++)
        for (int k = 0; k < 512; k++)
            state[k] = state[k] * 0.5 + state[(k * 7 + 1) & 511];
}

int rtapi_app_main(void)
{
    static const char LETTERS[] = "xyzac";
    static const struct {
        const char *name;
        void (*row)(void *, long);
    } ROWS[] = {{"matrix", matrix_row}, {"kins", kins_row}, {"nothing", nothing_row},
                {"pins-in", pins_in_row}, {"pins-out", pins_out_row}, {"work", work_row}};
    int error = component = hal_init(NAME);
    if (error < 0)
        return error;
    make_machine();
    pins = hal_malloc(sizeof *pins);
    error = pins == NULL ? -1 : 0;
    for (int k = 0; k < AXES && !error; k++) {
        const struct {
            const char *name;
            hal_pin_dir_t direction;
            hal_float_t **pin;
        } FLOATS[] = {
            {"position", HAL_IN, &pins->position[k]}, {"pose", HAL_IN, &pins->pose[k]},
            {"correction", HAL_OUT, &pins->correction[k]}, {"joint", HAL_OUT, &pins->joint[k]},
            {"command", HAL_IN, &pins->command[k]}, {"drive", HAL_OUT, &pins->drive[k]},
            {"feedback", HAL_IN, &pins->feedback[k]}, {"back", HAL_OUT, &pins->back[k]},
        };
        for (size_t n = 0; n < sizeof FLOATS / sizeof *FLOATS && !error; n++)
            error = hal_pin_float_newf(FLOATS[n].direction, FLOATS[n].pin, component, NAME ".%s-%c", FLOATS[n].name,
                                       LETTERS[k]);
        if (!error) error = hal_pin_bit_newf(HAL_IN, &pins->homed[k], component, NAME ".homed-%c", LETTERS[k]);
        if (!error) error = hal_pin_bit_newf(HAL_IN, &pins->homing[k], component, NAME ".homing-%c", LETTERS[k]);
    }
    for (size_t n = 0; n < sizeof ROWS / sizeof *ROWS && !error; n++) {
        char name[HAL_NAME_LEN + 1];
        snprintf(name, sizeof name, NAME ".%s", ROWS[n].name);
        error = hal_export_funct(name, ROWS[n].row, NULL, 1, 0, component);
    }
    if (error) {
        hal_exit(component);
        return error;
    }
    return hal_ready(component);
}

void rtapi_app_exit(void)
{
    hal_exit(component);
}
