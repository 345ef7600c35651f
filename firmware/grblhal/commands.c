/* SPDX-License-Identifier: MIT
 * Copyright (c) 2026 The trueaxis maintainers
 */
#include "commands.h"
#include "blob.h"
#include "compensation.h"
#include "motion.h"
#include "pieces.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A line of an answer. */
static char line[200];

static void add(const char *text)
{
    strncat(line, text, sizeof line - strlen(line) - 1);
}

static void add_number(double number, uint8_t decimals)
{
    add(ftoa((float)number, decimals));
}

static void begin(void)
{
    line[0] = '\0';
    add("[TRUEAXIS:");
}

static void send(void)
{
    add("]" ASCII_EOL);
    hal.stream.write(line);
}

static void say_axis(size_t number)
{
    double computed[TRUEAXIS_AXES];
    size_t place;
    const trueaxis_axis *axis = txa_axis(number, &place);
    const char *unit = axis->unit == TRUEAXIS_DEGREES ? " deg" : " mm";
    const char name[] = {axis->name, ' ', '\0'};
    double speed = (double)settings.axis[place].max_rate / 60.0;
    double acceleration = (double)settings.axis[place].acceleration / 3600.0;
    double piece = speed * txa_piece_time();
    txa_computed(computed);
    begin();
    add(name);
    add_number(txa_correction()[place], 5);
    add(" of ");
    add_number(computed[number], 5);
    add(", bound ");
    add_number(axis->value_bound, 5);
    add(unit);
    add("; piece ");
    add_number(piece, 3);
    add(unit);
    add(" within ");
    add_number(txa_piece_deviation(number), 5);
    add(", full speed to F");
    add(uitoa((uint32_t)(60.0 * sqrt(2.0 * acceleration * piece * plan_get_buffer_size()))));
    send();
}

static void say_status(void)
{
    static const char *const modes[] = {"off", "on", "dry run"};
    char text[120];
    if (!txa_present()) {
        begin();
        add("inactive: " TXA_BLOB_PLACE ": ");
        add(txa_why());
        send();
        return;
    }
    trueaxis_status status = txa_status();
    begin();
    txa_machine(text, sizeof text);
    add(text);
    add(", ");
    add(modes[txa_get_mode()]);
    add(", factor ");
    add_number(status.factor, 3);
    trueaxis_conditions_text(status.conditions, text, sizeof text);
    add(text[0] != '\0' ? ": " : "");
    add(text);
    send();
    for (size_t k = 0; k < txa_axes(); k++)
        say_axis(k);
}

bool txa_load_and_say(void)
{
    bool loaded = txa_load();
    txa_pieces_from_tables();
    txa_motion_restart();
    if (!loaded) {
        line[0] = '\0';
        add("trueaxis: not in use: " TXA_BLOB_PLACE ": ");
        add(txa_why());
        report_message(line, Message_Warning);
    }
    return loaded;
}

/* What follows a word at the beginning of the argument, in any case; null if it begins with something else. */
static const char *after(const char *argument, const char *word)
{
    for (; *word != '\0'; word++, argument++)
        if (CAPS(*argument) != *word)
            return NULL;
    return *argument == '\0' || *argument == ' ' ? argument : NULL;
}

static bool is(const char *argument, const char *word)
{
    const char *rest = after(argument, word);
    return rest != NULL && *rest == '\0';
}

/* Without tables the mode is kept for when there are some, which is no reason to say ok. */
static status_code_t set_mode(txa_mode mode)
{
    txa_set_mode(mode);
    return txa_present() ? Status_OK : Status_FileReadError;
}

static status_code_t set_length(const char *text)
{
    char *end;
    float length = strtof(text, &end);
    if (end == text || *end != '\0' || !isfinite(length))
        return Status_BadNumberFormat;
    txa_set_length_without_g43(length);
    return Status_OK;
}

static status_code_t execute(sys_state_t state, char *argument)
{
    (void)state;
    if (argument == NULL) {
        say_status();
        return Status_OK;
    }
    if (is(argument, "ON"))
        return set_mode(TXA_ON);
    if (is(argument, "DRY"))
        return set_mode(TXA_DRY);
    if (is(argument, "OFF")) {
        txa_set_mode(TXA_OFF);
        return Status_OK;
    }
    if (after(argument, "LENGTH") != NULL)
        return set_length(after(argument, "LENGTH"));
    if (!is(argument, "LOAD"))
        return Status_InvalidStatement;
    if (!txa_motion_at_rest())
        return Status_IdleError;
    return txa_load_and_say() ? Status_OK : Status_FileReadError;
}

void txa_commands(void)
{
    static const sys_command_t commands[] = {
        {"TRUEAXIS", execute, {.flags = 0}, {.str = "status; =ON, =OFF, =DRY, =LOAD, =LENGTH mm"}},
    };
    static sys_commands_t registered = {.n_commands = sizeof commands / sizeof commands[0], .commands = commands};
    system_register_commands(&registered);
}
