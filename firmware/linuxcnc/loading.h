/* SPDX-License-Identifier: MIT
 *
 * Files, outside the real-time thread: read, checked, fitted to the joints, and handed over ready to use.
 *
 * There are two places for tables. A thread in the real-time thread's process, but without its priority, waits for
 * requests, loads into the free place and offers it; the real-time thread accepts it when it can and marks places
 * free again. Neither waits for the other: they share only atomic words.
 *
 * A thread is used rather than a separate program: the tables are in memory that the real-time thread reads, no
 * program has to be started, and the thread ends with the component.
 */
#ifndef LOADING_H
#define LOADING_H

#include "file.h"
#include "joints.h"
#include "trueaxis.h"

#include <errno.h>
#include <math.h>
#include <pthread.h>
#include <sched.h>
#include <signal.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define STACK (256 * 1024)

/* Values of the pin `fault-code`. */
enum trouble {
    TROUBLE_NONE = 0,
    TROUBLE_FILE = 1,
    TROUBLE_BLOB = 2,
    TROUBLE_AXES = 3,
    TROUBLE_PINS = 4,
    TROUBLE_ACTIVE = 5,
    TROUBLE_POSITION = 6,
    TROUBLE_TOOL_LENGTH = 7,
    TROUBLE_TEMPERATURE = 8,
    TROUBLE_WEIGHT = 9,
    TROUBLE_PERIOD = 10,
    TROUBLE_REACH = 11,
    TROUBLE_LIBRARY = 12
};

static const char *const TROUBLES[] = {
    "no fault any more",
    "the file cannot be read",
    "the file is refused",
    "the axes of the file differ from axes=",
    "the file needs more pins",
    "the file was not taken because corrections are active, and its axes, travels or inputs differ: set enable to 0, wait for active to become false, and reload",
    "pos-in of a joint is not connected, or not a number",
    "a correction depends on the length of the tool, and tool-length is not connected, or not a number",
    "a correction depends on a temperature that is not connected, or not a number",
    "a weight is not within its limits",
    "the period of the thread is not from 1 us to 10 ms",
    "a position is out of reach, or a temperature is implausible",
    "a mistake in the library: please report it",
};

/* Parameters from the line that loads the component; constant. */
static struct {
    const char *path;
    const char *letters; /* one per joint */
    int joints;
    int temperatures;
    int weights;
    double mm; /* length of a linear unit of the machine */
} configured;

/* Tables, and their mapping to the machine. */
struct place {
    trueaxis_tables_memory memory;
    trueaxis_tables *tables;
    void *blob;
    int in_use; /* atomic: 1 from the offer until the real-time thread no longer needs it */
    uint32_t sum;
    int axes;
    int axis_of[MOST_JOINTS];           /* for each joint: its axis, or -1 */
    double unit[TRUEAXIS_AXES];         /* length of a machine unit in mm or degrees */
    double per_unit[TRUEAXIS_AXES];     /* its inverse */
    double per_bound[TRUEAXIS_AXES];    /* 1 / the largest correction */
    int auxiliaries;
    int pin_of[TRUEAXIS_AUXILIARIES];   /* for each auxiliary input: its temperature pin, or -1 for the tool length */
    bool needed[TRUEAXIS_AUXILIARIES];  /* a correction depends on it */
    int terms;
    uint32_t term[TRUEAXIS_ADJUSTABLE]; /* index of the term of each weight pin */
};

static struct place places[2];
static pthread_t loader;
static bool loader_runs;

/* Shared by both threads, atomic. */
static struct place *offered;
static unsigned asked;
static unsigned answered;
static int load_trouble;
static int reported;
static int stopping;

#define GET(word) __atomic_load_n(&(word), __ATOMIC_ACQUIRE)
#define SET(word, value) __atomic_store_n(&(word), (value), __ATOMIC_RELEASE)
#define SAY(level, ...) rtapi_print_msg(level, "trueaxis: " __VA_ARGS__)

/* The real-time thread's side. */

static inline void loading_ask(void) { __atomic_add_fetch(&asked, 1, __ATOMIC_ACQ_REL); }
static inline unsigned loading_requests(void) { return GET(asked); }
static inline struct place *loading_offered(void) { return GET(offered); }
static inline void loading_take(void) { SET(offered, NULL); }
static inline bool loading_busy(void) { return GET(asked) != GET(answered) || GET(offered) != NULL; }
static inline enum trouble loading_trouble(void) { return (enum trouble)GET(load_trouble); }
static inline void loading_report(enum trouble trouble) { SET(reported, (int)trouble); }

/* Frees the places that no servo reads any more. */
static inline void loading_free_all_but(const struct place *kept)
{
    for (int p = 0; p < 2; p++)
        if (&places[p] != kept)
            SET(places[p].in_use, 0);
}

/* The loading thread's side. */

/* Maps joints to axes and units. */
static enum trouble fit_axes(struct place *p)
{
    for (int j = 0; j < configured.joints; j++) {
        size_t k = 0;
        p->axis_of[j] = -1;
        if (configured.letters[j] == '-')
            continue;
        if (trueaxis_tables_find_axis(p->tables, configured.letters[j], &k) != TRUEAXIS_RESULT_OK) {
            SAY(RTAPI_MSG_ERR, "%s has no axis %c, which axes=%s names for joint %d; write - there if it is not to be corrected\n",
                configured.path, configured.letters[j], configured.letters, j);
            return TROUBLE_AXES;
        }
        p->axis_of[j] = (int)k;
    }
    for (int k = 0; k < p->axes; k++) {
        trueaxis_axis axis;
        if (trueaxis_tables_axis(p->tables, (size_t)k, &axis) != TRUEAXIS_RESULT_OK)
            return TROUBLE_LIBRARY;
        if (strchr(configured.letters, axis.name) == NULL) {
            SAY(RTAPI_MSG_ERR, "%s has an axis %c, for which axes=%s names no joint\n", configured.path, axis.name,
                configured.letters);
            return TROUBLE_AXES;
        }
        p->unit[k] = axis.unit == TRUEAXIS_DEGREES ? 1.0 : configured.mm;
        p->per_unit[k] = 1.0 / p->unit[k];
        p->per_bound[k] = axis.value_bound > 0 ? 1.0 / (double)axis.value_bound : 0.0;
    }
    return TROUBLE_NONE;
}

/* The pin of an auxiliary input: -1 for the tool length, one for each sensor, whatever its lags. */
static int pin_for(const struct place *p, int number, const trueaxis_auxiliary *auxiliary, int *temperatures)
{
    if (auxiliary->kind == TRUEAXIS_TOOL_LENGTH)
        return -1;
    for (int a = 0; a < number; a++) {
        trueaxis_auxiliary earlier;
        if (p->pin_of[a] >= 0 && trueaxis_tables_auxiliary(p->tables, (size_t)a, &earlier) == TRUEAXIS_RESULT_OK &&
            strcmp(earlier.name, auxiliary->name) == 0)
            return p->pin_of[a];
    }
    return (*temperatures)++;
}

/* Maps inputs to pins. */
static enum trouble fit_inputs(struct place *p, const trueaxis_facts *facts)
{
    int temperatures = 0;
    p->auxiliaries = facts->auxiliaries;
    p->terms = facts->adjustable;
    for (int a = 0; a < p->auxiliaries; a++) {
        trueaxis_auxiliary auxiliary;
        if (trueaxis_tables_auxiliary(p->tables, (size_t)a, &auxiliary) != TRUEAXIS_RESULT_OK)
            return TROUBLE_LIBRARY;
        p->pin_of[a] = pin_for(p, a, &auxiliary, &temperatures);
        p->needed[a] = facts->inputs_used >> (p->axes + a) & 1;
        if (p->pin_of[a] >= configured.temperatures) {
            SAY(RTAPI_MSG_ERR, "%s: no pin for the temperature `%s`, number %d: write temperatures=%d or more\n",
                configured.path, auxiliary.name, p->pin_of[a], p->pin_of[a] + 1);
            return TROUBLE_PINS;
        }
        if (p->pin_of[a] >= 0)
            SAY(RTAPI_MSG_INFO, "temperature-%d is `%s`\n", p->pin_of[a], auxiliary.name);
    }
    for (int w = 0; w < p->terms; w++) {
        trueaxis_adjustable adjustable;
        if (trueaxis_tables_adjustable(p->tables, (size_t)w, &adjustable) != TRUEAXIS_RESULT_OK)
            return TROUBLE_LIBRARY;
        p->term[w] = adjustable.term;
    }
    return TROUBLE_NONE;
}

static enum trouble load_into(struct place *p)
{
    trueaxis_facts facts;
    trueaxis_result result;
    const char *why;
    char text[160];
    size_t length;
    enum trouble trouble;
    void *blob;
    if (configured.path[0] == 0) {
        SAY(RTAPI_MSG_ERR, "no file: write file=PATH.trax\n");
        return TROUBLE_FILE;
    }
    blob = read_file(configured.path, &length, &why);
    if (blob == NULL) {
        SAY(RTAPI_MSG_ERR, "%s: %s\n", configured.path, why);
        return TROUBLE_FILE;
    }
    result = trueaxis_tables_load(p->tables, blob, length);
    if (result == TRUEAXIS_RESULT_IN_USE) {
        free(blob);
        return TROUBLE_LIBRARY;
    }
    /* The previous content is no longer read: this place is free. */
    free(p->blob);
    p->blob = blob;
    if (result != TRUEAXIS_RESULT_OK) {
        trueaxis_tables_reason(p->tables, text, sizeof text);
        SAY(RTAPI_MSG_ERR, "%s: %s: %s\n", configured.path, trueaxis_result_text(result), text);
        return TROUBLE_BLOB;
    }
    if (trueaxis_tables_facts(p->tables, &facts) != TRUEAXIS_RESULT_OK)
        return TROUBLE_LIBRARY;
    p->sum = facts.checksum;
    p->axes = facts.axes;
    trouble = fit_axes(p);
    if (trouble == TROUBLE_NONE)
        trouble = fit_inputs(p, &facts);
    if (trouble == TROUBLE_NONE) {
        trueaxis_tables_machine(p->tables, text, sizeof text);
        SAY(RTAPI_MSG_INFO, "%s: %s, %d axes, checksum %08x\n", configured.path, text, p->axes, (unsigned)p->sum);
    }
    return trouble;
}

/* Loads into the free place and offers it; returns false if none is free. */
static bool load(void)
{
    for (int n = 0; n < 2; n++) {
        struct place *p = &places[n];
        enum trouble trouble;
        if (GET(p->in_use))
            continue;
        trouble = load_into(p);
        SET(load_trouble, (int)trouble);
        if (trouble == TROUBLE_NONE) {
            SET(p->in_use, 1);
            SET(offered, p);
        }
        return true;
    }
    return false;
}

static void *loader_main(void *nothing)
{
    const struct timespec nap = {0, 20 * 1000 * 1000};
    int said = TROUBLE_NONE;
    while (!GET(stopping)) {
        unsigned want = GET(asked);
        int now = GET(reported);
        if (now != said) {
            if (now == TROUBLE_NONE)
                SAY(RTAPI_MSG_ERR, "%s\n", TROUBLES[now]);
            else
                SAY(RTAPI_MSG_ERR, "fault %d: %s\n", now, TROUBLES[now]);
            said = now;
        }
        /* One at a time: the offered tables must be accepted or refused before the next file is read. */
        if (want != GET(answered) && GET(offered) == NULL && load())
            SET(answered, want);
        nanosleep(&nap, NULL);
    }
    return nothing;
}

/* Checks and stores the parameters; returns the number of joints, or a negative error. */
static int loading_configure(const char *path, const char *letters, const char *unit, int temperatures, int weights)
{
    configured.path = path;
    configured.letters = letters;
    configured.joints = joints_of(letters);
    configured.temperatures = temperatures;
    configured.weights = weights;
    configured.mm = mm_of(unit);
    if (configured.joints == 0)
        SAY(RTAPI_MSG_ERR, "axes=%s: write the letter of the axis of each joint, from joint 0, such as axes=XYZAC; - for a joint that is not corrected\n", letters);
    else if (configured.mm == 0.0)
        SAY(RTAPI_MSG_ERR, "units=%s: write units=mm or units=inch, what [TRAJ]LINEAR_UNITS says\n", unit);
    else if (temperatures < 0 || temperatures > TRUEAXIS_AUXILIARIES || weights < 0 || weights > TRUEAXIS_ADJUSTABLE)
        SAY(RTAPI_MSG_ERR, "temperatures= is from 0 to %d, weights= from 0 to %d\n", TRUEAXIS_AUXILIARIES, TRUEAXIS_ADJUSTABLE);
    else
        return configured.joints;
    return -EINVAL;
}

/* Loads the file, which may fail, and starts the thread. */
static int loading_start(void)
{
    pthread_attr_t attributes;
    struct sched_param priority = {.sched_priority = 0};
    sigset_t all, before;
    int error = 0;
    SET(stopping, 0);
    for (int n = 0; n < 2; n++) {
        trueaxis_result result = trueaxis_tables_new(TRUEAXIS_HEADER, &places[n].memory, sizeof places[n].memory, &places[n].tables);
        if (result != TRUEAXIS_RESULT_OK) {
            SAY(RTAPI_MSG_ERR, "%s\n", trueaxis_result_text(result));
            return -EINVAL;
        }
    }
    load();
    pthread_attr_init(&attributes);
    /* All memory of this process is locked. */
    pthread_attr_setstacksize(&attributes, STACK);
    pthread_attr_setinheritsched(&attributes, PTHREAD_EXPLICIT_SCHED);
    pthread_attr_setschedpolicy(&attributes, SCHED_OTHER);
    pthread_attr_setschedparam(&attributes, &priority);
    /* Signals are for the other threads. */
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before);
    error = pthread_create(&loader, &attributes, loader_main, NULL);
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    pthread_attr_destroy(&attributes);
    loader_runs = error == 0;
    return -error;
}

static void loading_stop(void)
{
    SET(stopping, 1);
    if (loader_runs)
        pthread_join(loader, NULL);
    loader_runs = false;
}

/* Runs when the component is unloaded, after its functions have been removed from their threads. */
static void __attribute__((destructor)) loading_end(void)
{
    for (int n = 0; n < 2; n++)
        free(places[n].blob);
}

#endif
