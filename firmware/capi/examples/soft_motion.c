/* A soft motion core without a hardware layer: a planner in double precision and a loop of 4 kHz.
 *
 * soft_motion FILE.trax [SECONDS]
 *
 * What an EtherCAT master does in its cycle is in `cycle`: plan, correct, send; and read back, take the
 * correction out, show. The rest plays the planner and the drives. It runs as fast as it can, one cycle after
 * the other; with a master, `cycle` is its callback.
 */
#include "trueaxis.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define PERIOD 0.00025

/* State owned by the real-time thread. */
struct motion {
    trueaxis_servo *servo;
    size_t axes;
    trueaxis_axis axis[TRUEAXIS_AXES];
    double command[TRUEAXIS_AXES];    /* from the planner: uncorrected */
    double correction[TRUEAXIS_AXES]; /* of the last period */
    double target[TRUEAXIS_AXES];     /* for the drives */
    double feedback[TRUEAXIS_AXES];   /* for the planner: uncorrected again */
    double fastest[TRUEAXIS_AXES];    /* largest step of a correction, for the summary */
    uint32_t referenced;
    trueaxis_result result;
};

/* The planner: every axis moves to and fro in its travel, endless axes turn continuously. */
static void plan(struct motion *m, double time)
{
    for (size_t k = 0; k < m->axes; k++) {
        const trueaxis_axis *axis = &m->axis[k];
        if (axis->turn > 0) {
            m->command[k] = 720.0 * time + 0.1 * (double)k;
        } else {
            double middle = 0.5 * ((double)axis->lower + (double)axis->upper);
            double half = 0.45 * ((double)axis->upper - (double)axis->lower);
            m->command[k] = middle + half * sin((1.0 + 0.3 * (double)k) * time);
        }
    }
}

/* One cycle of the fieldbus. `actual`: the positions of the drives, which is what they were sent before. */
static void cycle(struct motion *m, double time, const double *actual)
{
    double before[TRUEAXIS_AXES];
    /* 1. What comes back contains the correction sent in the last period: subtract that one, never a fresh
     *    evaluation, or the following error would show the difference. */
    for (size_t k = 0; k < m->axes; k++)
        m->feedback[k] = actual[k] - m->correction[k];
    /* 2. The planner sees uncorrected positions only. */
    plan(m, time);
    /* 3. Correct, and send. Whatever the result, the drives follow the command. */
    memcpy(before, m->correction, sizeof before);
    m->result = trueaxis_servo_update(m->servo, m->command, m->axes, m->referenced, PERIOD, m->correction);
    for (size_t k = 0; k < m->axes; k++) {
        double step = fabs(m->correction[k] - before[k]);
        m->target[k] = m->command[k] + m->correction[k];
        if (step > m->fastest[k])
            m->fastest[k] = step;
    }
}

static uint32_t blob[65536];
static trueaxis_tables_memory tables_memory;
static trueaxis_servo_memory servo_memory;

static int refused(const trueaxis_tables *tables, trueaxis_result result)
{
    char why[160];
    trueaxis_tables_reason(tables, why, sizeof why);
    fprintf(stderr, "%s: %s\n", trueaxis_result_text(result), why);
    return 1;
}

/* Not real-time: files, memory, texts. */
static int prepare(struct motion *m, const char *path)
{
    trueaxis_tables *tables = NULL;
    trueaxis_facts facts;
    trueaxis_result result;
    size_t length;
    char machine[64];
    FILE *file = fopen(path, "rb");
    if (file == NULL) {
        perror(path);
        return 1;
    }
    length = fread(blob, 1, sizeof blob, file);
    fclose(file);
    result = trueaxis_tables_new(TRUEAXIS_HEADER, &tables_memory, sizeof tables_memory, &tables);
    if (result == TRUEAXIS_RESULT_OK)
        result = trueaxis_tables_load(tables, blob, length);
    if (result == TRUEAXIS_RESULT_OK)
        result = trueaxis_tables_facts(tables, &facts);
    if (result == TRUEAXIS_RESULT_OK)
        result = trueaxis_servo_new(&servo_memory, sizeof servo_memory, tables, &m->servo);
    if (result != TRUEAXIS_RESULT_OK)
        return refused(tables, result);
    m->axes = facts.axes;
    m->referenced = (1u << facts.axes) - 1u;
    for (size_t k = 0; k < m->axes; k++)
        if (trueaxis_tables_axis(tables, k, &m->axis[k]) != TRUEAXIS_RESULT_OK)
            return 1;
    /* Every auxiliary input must be set: one that was never set is a fault, not 0. */
    for (size_t k = 0; k < facts.auxiliaries; k++) {
        trueaxis_auxiliary auxiliary;
        if (trueaxis_tables_auxiliary(tables, k, &auxiliary) != TRUEAXIS_RESULT_OK ||
            trueaxis_servo_set_auxiliary(m->servo, k, (double)auxiliary.reference) != TRUEAXIS_RESULT_OK)
            return 1;
    }
    trueaxis_tables_machine(tables, machine, sizeof machine);
    printf("%s: %u axes, %u tables, format %u\n", machine, facts.axes, facts.tables, facts.version);
    return trueaxis_servo_enable(m->servo, 1) != TRUEAXIS_RESULT_OK;
}

int main(int count, char **words)
{
    static struct motion motion;
    struct motion *m = &motion;
    double actual[TRUEAXIS_AXES] = {0};
    trueaxis_status status;
    char conditions[128];
    long cycles = (long)((count > 2 ? atof(words[2]) : 10.0) / PERIOD);
    double worst = 0.0;
    if (count < 2 || prepare(m, words[1]) != 0)
        return 1;
    for (long k = 0; k < cycles; k++) {
        double last[TRUEAXIS_AXES];
        memcpy(last, m->command, sizeof last);
        cycle(m, (double)k * PERIOD, actual);
        if (m->result != TRUEAXIS_RESULT_OK) {
            fprintf(stderr, "%s\n", trueaxis_result_text(m->result));
            return 1;
        }
        /* The drives follow at once, so the planner must see its own commands. */
        for (size_t a = 0; a < m->axes; a++) {
            if (k > 0 && fabs(m->feedback[a] - last[a]) > worst)
                worst = fabs(m->feedback[a] - last[a]);
            actual[a] = m->target[a];
        }
    }
    if (trueaxis_servo_status(m->servo, &status) != TRUEAXIS_RESULT_OK)
        return 1;
    trueaxis_conditions_text(status.conditions, conditions, sizeof conditions);
    printf("factor %.3f, conditions: %s\n", (double)status.factor, conditions[0] ? conditions : "none");
    for (size_t a = 0; a < m->axes; a++) {
        const char *unit = m->axis[a].unit == TRUEAXIS_DEGREES ? "deg" : "mm";
        printf("%c %+.6f %s, %.4f %s/s at most\n", m->axis[a].name, m->correction[a], unit,
               m->fastest[a] / PERIOD, unit);
        /* A correction never steps by more than its rate bound permits, except for float rounding. */
        if (m->fastest[a] > (double)m->axis[a].rate_bound * PERIOD * 1.001 + 1e-6)
            return 1;
    }
    printf("feedback against command: %.1e\n", worst);
    /* Doubles: sums of positions below 1e5 and corrections round by 1e-11. */
    return worst > 1e-10 || trueaxis_servo_release(m->servo) != TRUEAXIS_RESULT_OK;
}
