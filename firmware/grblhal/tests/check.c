/* SPDX-License-Identifier: MIT
 * Copyright (c) 2026 The trueaxis maintainers
 */
#include "check.h"

struct oracle oracle;
float started_at[N_AXIS];

static struct blob all[] = {
    {.name = "huron-13"}, {.name = "router-10"}, {.name = "table-head-13"}, {.name = "everything"}, {.name = "lag"},
};
static trueaxis_tables_memory tables_memory;
static trueaxis_servo_memory servo_memory;
static trueaxis_tables *tables;
static trueaxis_servo *servo;

double between(double low, double high)
{
    static uint64_t state = 20260822;
    state = state * 6364136223846793005u + 1442695040888963407u;
    return low + (high - low) * (double)(state >> 11) / 9007199254740992.0;
}

struct blob *blob(const char *name)
{
    for (size_t k = 0; k < sizeof all / sizeof all[0]; k++)
        if (strcmp(all[k].name, name) == 0)
            return &all[k];
    CHECK(false, "no blob %s", name);
    return NULL;
}

void read_blobs(const char *folder)
{
    for (size_t k = 0; k < sizeof all / sizeof all[0]; k++) {
        char path[400];
        snprintf(path, sizeof path, "%s/%s.trax", folder, all[k].name);
        FILE *file = fopen(path, "rb");
        CHECK(file != NULL, "%s", path);
        all[k].length = fread(all[k].bytes, 1, sizeof all[k].bytes, file);
        CHECK(all[k].length > 0 && all[k].length < sizeof all[k].bytes, "%s", path);
        fclose(file);
    }
}

static void ask_once_more(const struct blob *file)
{
    trueaxis_facts facts;
    trueaxis_servo_release(servo);
    servo = NULL;
    CHECK(trueaxis_tables_new(TRUEAXIS_HEADER, &tables_memory, sizeof tables_memory, &tables) == 0, "tables");
    CHECK(trueaxis_tables_load(tables, file->bytes, file->length) == 0, "%s", file->name);
    CHECK(trueaxis_tables_facts(tables, &facts) == 0, "facts");
    oracle.axes = facts.axes;
    for (size_t k = 0; k < oracle.axes; k++) {
        trueaxis_tables_axis(tables, k, &oracle.axis[k]);
        for (size_t i = 0; i < N_AXIS; i++)
            if (axis_letter[i][0] == oracle.axis[k].name)
                oracle.place[k] = i;
    }
    CHECK(trueaxis_servo_new(&servo_memory, sizeof servo_memory, tables, &servo) == 0, "servo");
    trueaxis_servo_enable(servo, 1);
}

void corrections_at(const float *command, double *correction)
{
    double in[TRUEAXIS_AXES], out[TRUEAXIS_AXES] = {0}, before[TRUEAXIS_AXES];
    trueaxis_status status = {0};
    for (size_t k = 0; k < oracle.axes; k++)
        in[k] = command[oracle.place[k]];
    int still = 0;
    for (int step = 0; still < 30; step++) {
        CHECK(step < 10000, "does not come to rest");
        memcpy(before, out, sizeof before);
        CHECK(trueaxis_servo_update(servo, in, oracle.axes, 0xFF, 0.01, out) == 0, "update");
        trueaxis_servo_status(servo, &status);
        bool rests = memcmp(before, out, sizeof before) == 0 && status.factor == 1.0f;
        still = rests ? still + 1 : 0;
    }
    for (size_t i = 0; i < N_AXIS; i++)
        correction[i] = 0.0;
    for (size_t k = 0; k < oracle.axes; k++)
        correction[oracle.place[k]] = out[k];
}

double piece_time(void)
{
    double time = 0.1;
    for (size_t k = 0; k < oracle.axes; k++) {
        double deviation = oracle.axis[k].unit == TRUEAXIS_DEGREES ? 0.0003 : 0.0005;
        double rate = (double)oracle.axis[k].rate_bound - (double)oracle.axis[k].ramp_rate;
        time = fmin(time, 2.0 * deviation / rate);
    }
    return fmax(time, 0.001);
}

double top_speed_time(const float *from, const float *to)
{
    double time = 0.0;
    for (size_t i = 0; i < N_AXIS; i++)
        time = fmax(time, fabs((double)to[i] - (double)from[i]) / ((double)settings.axis[i].max_rate / 60.0));
    return time;
}

void piece_end(const float *from, const float *to, size_t k, size_t n, float *end)
{
    for (size_t i = 0; i < N_AXIS; i++)
        end[i] = k == n ? to[i] : (float)((double)from[i] + ((double)to[i] - (double)from[i]) * (double)k / (double)n);
}

void within_rate_bound(const char *what, const float *motors, const float *from, const float *to, float feed,
                       size_t first, double steps)
{
    size_t n = planned - first;
    float begin[N_AXIS], end[N_AXIS];
    memcpy(begin, from, sizeof begin);
    for (size_t k = 1; k <= n; k++) {
        double square = 0.0;
        piece_end(from, to, k, n, end);
        for (size_t i = 0; i < 3; i++)
            square += ((double)end[i] - (double)begin[i]) * ((double)end[i] - (double)begin[i]);
        double time = top_speed_time(begin, end);
        /* The feed override goes up to 200 %. */
        if (feed > 0.0f)
            time = fmax(time, 30.0 * sqrt(square) / (double)feed);
        const float *before = k == 1 ? motors : blocks[first + k - 2].plan.target_mm;
        const float *after = blocks[first + k - 1].plan.target_mm;
        for (size_t j = 0; j < oracle.axes; j++) {
            size_t i = oracle.place[j];
            double change = ((double)after[i] - (double)end[i]) - ((double)before[i] - (double)begin[i]);
            /* f32 positions up to 1000 mm or degrees, four of them. The shown position is known to this many steps,
             * which affect the first difference, and an n-th of them the others, because the start of a line shifts
             * its pieces. */
            double shift = (k == 1 ? steps : steps / (double)n) / (double)settings.axis[i].steps_per_mm;
            double rounding = 4 * 3.1e-5 + shift;
            CHECK(fabs(change) <= (double)oracle.axis[j].rate_bound * time + rounding,
                  "%s: axis %c changes by %g in %g s, block %zu of %zu", what, oracle.axis[j].name, change, time, k, n);
        }
        memcpy(begin, end, sizeof begin);
    }
}

size_t random_block(size_t first)
{
    return (size_t)between((double)(first > executed ? first : executed), (double)planned);
}

void start_with(const struct blob *file)
{
    file_bytes = file == NULL ? NULL : file->bytes;
    file_size = file == NULL ? 0 : file->length;
    controller_start(NULL);
    CHECK(command("$TRUEAXIS=OFF") == Status_OK, "off");
}

void random_place(float *place)
{
    for (size_t i = 0; i < N_AXIS; i++)
        place[i] = 0.0f;
    for (size_t k = 0; k < oracle.axes; k++) {
        const trueaxis_axis *axis = &oracle.axis[k];
        double steps = settings.axis[oracle.place[k]].steps_per_mm;
        double low = axis->turn > 0 ? -720.0 : axis->lower + 0.02 * (axis->upper - axis->lower);
        double high = axis->turn > 0 ? 720.0 : axis->upper - 0.02 * (axis->upper - axis->lower);
        place[oracle.place[k]] = (float)(floor(between(low, high) * steps) / steps);
    }
}

void start_corrected(const struct blob *file)
{
    float *place = started_at;
    start_with(file);
    CHECK(said[0] == '\0', "%s: %s", file->name, said);
    ask_once_more(file);
    home(0xFF);
    CHECK(command("$TRUEAXIS=ON") == Status_OK, "on");
    for (int moves = 0; moves < 3; moves++) {
        random_place(place);
        CHECK(line_to(place, 3000), "a line");
        execute();
    }
    /* Time to catch up with backlash. */
    for (int moves = 0; moves < 4; moves++) {
        place[0] += moves % 2 ? 1.0f : -1.0f;
        CHECK(line_to(place, 50), "a line");
        execute();
    }
    planned = executed = 0;
    said_nothing();
    CHECK(command("$TRUEAXIS") == Status_OK && strstr(said, "on, factor 1.000") != NULL, "%s", said);
}
