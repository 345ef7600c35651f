/* A probing move stops at the part, however long it is: it is never more pieces than fit into the planner, which starts
 * to move when it is full, before grblHAL watches the probe.
 *
 * SPDX-License-Identifier: MIT
 * Copyright (c) 2026 The trueaxis maintainers
 */
#include "check.h"
#include "../pieces.h"

#define BRAKING 0.3f

static float place[N_AXIS];

static void start(void)
{
    const float there[] = {100, 100, -50};
    start_corrected(blob("router-10"));
    memcpy(place, there, sizeof there);
    CHECK(line_to(place, 3000), "there");
    execute();
    /* Backlash is made up. */
    for (int moves = 0; moves < 40; moves++) {
        place[0] += moves % 2 ? -20.0f : 20.0f;
        CHECK(line_to(place, 500), "to and fro");
        execute();
    }
    CHECK(line_to((place[0] += 20.0f, place), 500), "in the direction of probing");
    execute();
    planned = executed = 0;
}

static void a_probe_of(float length, float until, bool no_error, bool inches)
{
    float to[N_AXIS], at[N_AXIS], found[N_AXIS], before[N_AXIS];
    memcpy(to, place, sizeof to);
    to[0] += length;
    gc_state.modal.units_imperial = inches;
    wall = (struct wall){.axis = 0, .at = motor(0) + until, .sign = 1};
    CHECK(probe_to(to, 300, no_error), "%g mm: no contact", (double)length);
    float over = motor(0) - wall.at;
    CHECK(over >= 0.0f && over <= BRAKING + 0.001f, "%g mm: %g mm beyond the part", (double)length, (double)over);
    wall.sign = 0;
    /* The contact, shown as after G38.2, is the command whose corrected position is there. */
    system_convert_array_steps_to_mpos(found, sys.probe_position);
    double correction[N_AXIS];
    corrections_at(place, correction);
    corrections_at(found, correction);
    double off = (double)found[0] + correction[0] - (double)sys.probe_position[0] / (double)settings.axis[0].steps_per_mm;
    CHECK(fabs(off) < 0.0015, "%g mm: shown %g beside the contact", (double)length, off);
    /* The next motion begins where the motors are: nothing moves by itself, and the position is that of the parser. */
    shown(before);
    CHECK(memcmp(before, gc_state.position, sizeof before) == 0, "the parser is elsewhere");
    CHECK(line_to(place, 3000), "back");
    execute();
    shown(at);
    for (size_t i = 0; i < N_AXIS; i++)
        CHECK(fabsf(at[i] - place[i]) <= 1.5f / settings.axis[i].steps_per_mm, "back at %g", (double)at[i]);
    gc_state.modal.units_imperial = false;
    /* Backlash in the direction of probing. */
    for (int moves = 0; moves < 40; moves++) {
        at[0] = place[0] - (moves % 2 ? 0.0f : 20.0f);
        CHECK(line_to(at, 500), "to and fro");
        execute();
    }
}

static void any_length(void)
{
    static const float lengths[] = {10, 40, 80, 120, 200, 300};
    start();
    for (size_t k = 0; k < sizeof lengths / sizeof lengths[0]; k++)
        for (int kind = 0; kind < 4; kind++) {
            a_probe_of(lengths[k], 3.0f, kind % 2, kind / 2);
            a_probe_of(lengths[k], 0.8f * lengths[k], kind % 2, kind / 2);
            planned = executed = 0;
        }
}

static void without_contact(void)
{
    start();
    float to[N_AXIS], at[N_AXIS];
    memcpy(to, place, sizeof to);
    to[0] += 200.0f;
    CHECK(!probe_to(to, 300, true) && alarm == 0, "contact");
    CHECK(memcmp(gc_state.position, to, sizeof to) == 0, "the parser is elsewhere");
    shown(at);
    CHECK(fabsf(at[0] - to[0]) < 0.001f, "ends at %g", (double)at[0]);
    to[0] -= 200.0f;
    CHECK(!probe_to(to, 300, false) && alarm == 5, "contact");
    set_state(STATE_IDLE);
    /* Triggered already: no line follows, and the next one is an ordinary one. */
    wall = (struct wall){.axis = 0, .at = 0, .sign = 1};
    to[0] += 300.0f;
    CHECK(!probe_to(to, 300, false) && alarm == 4, "probes");
    wall.sign = 0;
    reset();
    shown(at);
    size_t first = planned;
    CHECK(line_to(to, 300) && planned - first >= txa_pieces(at, to) - 1, "%zu blocks", planned - first);
    execute();
}

void probing(void)
{
    any_length();
    without_contact();
}
