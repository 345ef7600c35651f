/* Tool-centre-point kinematics stay in use: they segment and transform, and their output is corrected.
 *
 * SPDX-License-Identifier: MIT
 * Copyright (c) 2026 The trueaxis maintainers
 */
#include "check.h"

/* C carries the workpiece 50 mm from its axis: X and Y follow. A line is cut into five. */
#define PARTS 5
static float emitted[PARTS * 100][N_AXIS]; /* uncorrected motor targets */
static size_t emissions, set_positions;
static coord_data_t told; /* reported start of the line */
static float speed = 1.0f;

static void to_motors(float *motors, const float *program)
{
    memcpy(motors, program, N_AXIS * sizeof *motors);
    double c = (double)program[5] * 3.14159265358979 / 180.0;
    motors[0] = (float)((double)program[0] + 50.0 * sin(c));
    motors[1] = (float)((double)program[1] + 50.0 * (1.0 - cos(c)));
}

static coord_data_t *from_steps(coord_data_t *position, mpos_t *steps)
{
    for (size_t i = 0; i < N_AXIS; i++)
        position->values[i] = (float)steps->values[i] / settings.axis[i].steps_per_mm;
    double c = (double)position->values[5] * 3.14159265358979 / 180.0;
    position->values[0] = (float)((double)position->values[0] - 50.0 * sin(c));
    position->values[1] = (float)((double)position->values[1] - 50.0 * (1.0 - cos(c)));
    return position;
}

static coord_data_t *segment(coord_data_t *target, coord_data_t *position, plan_line_data_t *data, bool init)
{
    static coord_data_t out;
    static float from[N_AXIS], to[N_AXIS];
    static int part;
    if (init) {
        static float program[N_AXIS];
        told = *position;
        memcpy(from, program, sizeof from);
        memcpy(to, target->values, sizeof to);
        memcpy(program, to, sizeof program);
        to_motors(out.values, to);
        part = 0;
        return &out;
    }
    if (part++ == PARTS)
        return NULL;
    float here[N_AXIS];
    for (size_t i = 0; i < N_AXIS; i++)
        here[i] = part == PARTS ? to[i] : from[i] + (to[i] - from[i]) * (float)part / PARTS;
    to_motors(out.values, here);
    memcpy(emitted[emissions++], out.values, sizeof here);
    data->feed_rate *= speed;
    data->rate_multiplier = 1.0f / speed;
    return &out;
}

static void set_machine_positions(axes_signals_t cycle)
{
    set_positions++;
    limits_set_machine_positions(cycle, true);
}

static void tool_centre_point(void)
{
    kinematics.segment_line = segment;
    kinematics.transform_steps_to_cartesian = from_steps;
    kinematics.limits_set_machine_positions = set_machine_positions;
}

static void change_over(sys_state_t state, parser_block_t *block)
{
    (void)state;
    if (block->user_mcode == 851)
        tool_centre_point();
}

static void set_up(void)
{
    tool_centre_point();
    grbl.user_mcode.execute = change_over;
}

static void random_line(bool exactly)
{
    float to[N_AXIS] = {0}, at[N_AXIS];
    size_t first = planned, cancelled_for = emissions;
    static float before[N_AXIS];
    memcpy(before, emissions > 0 ? emitted[emissions - 1] : before, sizeof before);
    for (size_t i = 0; i < N_AXIS; i++)
        to[i] = (float)floor(between(-90, 90));
    to[4] = 0;
    CHECK(line_to(to, 4000) && emissions == cancelled_for + PARTS, "%zu parts", emissions - cancelled_for);
    if (exactly)
        CHECK(memcmp(told.values, before, sizeof before) == 0, "the kinematics were told a corrected position");
    size_t block = first;
    for (size_t k = cancelled_for; exactly && k < emissions; k++) {
        double pieces = fmax(ceil(top_speed_time(before, emitted[k]) / piece_time()), 1.0);
        for (size_t piece = 1; piece <= (size_t)pieces; piece++, block++) {
            float end[N_AXIS];
            double correction[N_AXIS];
            piece_end(before, emitted[k], piece, (size_t)pieces, end);
            corrections_at(end, correction);
            for (size_t i = 0; i < N_AXIS; i++) {
                float expected = (float)((double)end[i] + correction[i]);
                CHECK(expected == blocks[block].plan.target_mm[i], "axis %zu of part %zu, piece %zu", i, k, piece);
            }
            CHECK(blocks[block].data.feed_rate == 4000.0f * speed && blocks[block].data.rate_multiplier == 1.0f / speed,
                  "the feed of the kinematics");
        }
        memcpy(before, emitted[k], sizeof before);
    }
    CHECK(!exactly || block == planned, "%zu blocks, not %zu", planned - first, block - first);
    execute();
    shown(at);
    /* One step each for the motors and for the shown position. */
    for (size_t i = 0; exactly && i < N_AXIS; i++)
        CHECK(fabsf(at[i] - to[i]) <= 2.0f / settings.axis[i].steps_per_mm, "%zu shown at %g, not %g", i, (double)at[i],
              (double)to[i]);
    if (emissions + PARTS > PARTS * 99)
        emissions = 0;
}

void kinematics_within(void)
{
    start_corrected(blob("huron-13")); /* to know the library's result */
    controller_start(set_up);
    CHECK(said[0] == '\0', "%s", said);
    home(0xFF);
    CHECK(set_positions == 1, "homing");
    CHECK(command("$TRUEAXIS=ON") == Status_OK, "on");
    for (int moves = 0; moves < 20; moves++)
        random_line(false);
    planned = executed = 0;
    for (int moves = 0; moves < 40; moves++) {
        speed = moves < 20 ? 1.0f : 2.0f;
        random_line(emissions > 0);
    }
    /* An M-code replaces the entries: they are wrapped again, once. */
    parser_block_t block = {.user_mcode = 851};
    for (int again = 0; again < 3; again++) {
        coord_data_t *(*chained)(coord_data_t *, coord_data_t *, plan_line_data_t *, bool) = kinematics.segment_line;
        grbl.user_mcode.execute(STATE_IDLE, &block);
        CHECK(kinematics.segment_line == chained && chained != segment, "not chained");
        random_line(emissions > 0);
        block.user_mcode = (uint16_t)(again == 0 ? 1 : 851);
    }
}
