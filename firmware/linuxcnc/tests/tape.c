/* SPDX-License-Identifier: MIT
 *
 * For tests only: plays rows of numbers to pins, one row per period, and records pins, to the last bit.
 *
 *   loadrt tape play=FILE out=TYPES record=FILE in=TYPES rows=N
 *
 * TYPES has a letter for each pin: f float, b bit, u unsigned, s signed. Both files are rows of doubles in the
 * order of the machine. `tape.run`: the next row in every period; until then, the first row. `tape.keep`: record.
 * The recording is written when the component is unloaded.
 */
#include "rtapi.h"
#include "rtapi_app.h"
#include "hal.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

MODULE_LICENSE("Dual MIT/GPL");

static char *play = "";
RTAPI_MP_STRING(play, "rows to be played");
static char *out = "";
RTAPI_MP_STRING(out, "types of the pins that they go to");
static char *record = "";
RTAPI_MP_STRING(record, "where to write what was recorded");
static char *in = "";
RTAPI_MP_STRING(in, "types of the pins that are recorded");
static int rows = 0;
RTAPI_MP_INT(rows, "most rows to be recorded");

#define MOST 64

typedef union {
    hal_float_t *f;
    hal_bit_t *b;
    hal_u32_t *u;
    hal_s32_t *s;
} pin;

static struct pins {
    pin out[MOST], in[MOST];
    hal_bit_t *run, *keep, *done;
    hal_u32_t *row, *kept;
} *pins;
static int component;
static double *played, *recorded;
static long played_rows;

static void play_row(void *nothing, long period)
{
    size_t columns = strlen(out);
    (void)nothing;
    (void)period;
    if (*pins->run && *pins->row + 1 < (unsigned long)played_rows)
        ++*pins->row;
    *pins->done = *pins->row + 1 >= (unsigned long)played_rows;
    for (size_t c = 0; c < columns; c++) {
        double value = played[*pins->row * columns + c];
        switch (out[c]) {
        case 'f': *pins->out[c].f = value; break;
        case 'b': *pins->out[c].b = value != 0; break;
        case 'u': *pins->out[c].u = (hal_u32_t)value; break;
        case 's': *pins->out[c].s = (hal_s32_t)value; break;
        }
    }
}

static void record_row(void *nothing, long period)
{
    size_t columns = strlen(in);
    (void)nothing;
    (void)period;
    if (!*pins->keep || *pins->kept >= (unsigned)rows)
        return;
    for (size_t c = 0; c < columns; c++) {
        double *to = &recorded[*pins->kept * columns + c];
        switch (in[c]) {
        case 'f': *to = *pins->in[c].f; break;
        case 'b': *to = *pins->in[c].b != 0; break;
        case 'u': *to = *pins->in[c].u; break;
        case 's': *to = *pins->in[c].s; break;
        }
    }
    ++*pins->kept;
}

static int export_pins(const char *types, const char *what, hal_pin_dir_t direction, pin *to)
{
    int error = 0;
    if (strlen(types) > MOST)
        return -EINVAL;
    for (int c = 0; types[c] && !error; c++) {
        switch (types[c]) {
        case 'f': error = hal_pin_float_newf(direction, &to[c].f, component, "tape.%s-%02d", what, c); break;
        case 'b': error = hal_pin_bit_newf(direction, &to[c].b, component, "tape.%s-%02d", what, c); break;
        case 'u': error = hal_pin_u32_newf(direction, &to[c].u, component, "tape.%s-%02d", what, c); break;
        case 's': error = hal_pin_s32_newf(direction, &to[c].s, component, "tape.%s-%02d", what, c); break;
        default: error = -EINVAL;
        }
    }
    return error;
}

static int read_rows(void)
{
    size_t columns = strlen(out);
    FILE *from = fopen(play, "rb");
    long bytes;
    if (from == NULL || fseek(from, 0, SEEK_END) != 0)
        return -ENOENT;
    bytes = ftell(from);
    rewind(from);
    played_rows = bytes / (long)(sizeof *played * columns);
    played = malloc((size_t)bytes + 1);
    if (played == NULL || played_rows < 1 || fread(played, 1, (size_t)bytes, from) != (size_t)bytes)
        return -EIO;
    fclose(from);
    return 0;
}

int rtapi_app_main(void)
{
    int error = component = hal_init("tape");
    if (error < 0)
        return error;
    pins = hal_malloc(sizeof *pins);
    recorded = malloc((size_t)(rows + 1) * strlen(in) * sizeof *recorded + 1);
    if (pins == NULL || recorded == NULL)
        return -ENOMEM;
    /* Touched now, so that the real-time thread causes no page faults. */
    memset(recorded, 0, (size_t)(rows + 1) * strlen(in) * sizeof *recorded);
    error = out[0] ? read_rows() : 0;
    if (!error) error = export_pins(out, "out", HAL_OUT, pins->out);
    if (!error) error = export_pins(in, "in", HAL_IN, pins->in);
    if (!error) error = hal_pin_bit_newf(HAL_IN, &pins->run, component, "tape.run");
    if (!error) error = hal_pin_bit_newf(HAL_IN, &pins->keep, component, "tape.keep");
    if (!error) error = hal_pin_bit_newf(HAL_OUT, &pins->done, component, "tape.done");
    if (!error) error = hal_pin_u32_newf(HAL_OUT, &pins->row, component, "tape.row");
    if (!error) error = hal_pin_u32_newf(HAL_OUT, &pins->kept, component, "tape.kept");
    if (!error) error = hal_export_funct("tape.play", play_row, NULL, 1, 0, component);
    if (!error) error = hal_export_funct("tape.record", record_row, NULL, 1, 0, component);
    if (error) {
        rtapi_print_msg(RTAPI_MSG_ERR, "tape: error %d\n", error);
        hal_exit(component);
        return error;
    }
    return hal_ready(component);
}

void rtapi_app_exit(void)
{
    FILE *to = record[0] ? fopen(record, "wb") : NULL;
    if (to != NULL) {
        fwrite(recorded, strlen(in) * sizeof *recorded, *pins->kept, to);
        fclose(to);
    } else if (record[0]) {
        rtapi_print_msg(RTAPI_MSG_ERR, "tape: %s cannot be written\n", record);
    }
    hal_exit(component);
    free(played);
    free(recorded);
}
