/* Tool length from G43, temperatures, and reported faults.
 *
 * SPDX-License-Identifier: MIT
 * Copyright (c) 2026 The trueaxis maintainers
 */
#include "check.h"
#include "../trueaxis_grblhal.h"

/* Goes to a place and back until every transition is over; returns the corrections there, as a sum with a different
 * weight for each axis. */
static double corrected_by(void)
{
    float to[N_AXIS] = {50, 40, -30}, away[N_AXIS] = {60, 40, -30};
    for (int moves = 0; moves < 40; moves++) {
        CHECK(line_to(away, 3000) && line_to(to, 3000), "moves");
        execute();
    }
    double sum = 0.0;
    for (size_t i = 0; i < N_AXIS; i++)
        sum += (double)(1 + i) * ((double)motor(i) - (double)to[i]);
    return sum;
}

void inputs(void)
{
    start_with(blob("everything"));
    home(0xFF);
    CHECK(command("$TRUEAXIS=ON") == Status_OK, "on");
    /* Neither length nor temperature is known: a fault that is reported once, and no correction; they never count as
       0 mm. */
    said_nothing();
    CHECK(corrected_by() == 0.0, "corrected");
    CHECK(strstr(said, "bad auxiliary") != NULL && strchr(said, '\n') == strrchr(said, '\n'), "%s", said);
    gc_state.modal.tool_offset_mode = ToolLengthOffset_Enable;
    gc_state.modal.tool_length_offset[Z_AXIS] = 120.0f;
    CHECK(corrected_by() == 0.0, "without a temperature");
    CHECK(!trueaxis_set_temperature("column", 21.0f) && trueaxis_set_temperature("bed", 21.0f), "sensors");
    gc_state.modal.tool_offset_mode = ToolLengthOffset_Cancel;
    CHECK(corrected_by() == 0.0, "without a tool length");
    /* G43. */
    gc_state.modal.tool_offset_mode = ToolLengthOffset_Enable;
    double with_120 = corrected_by();
    CHECK(with_120 != 0.0, "not corrected");
    gc_state.modal.tool_length_offset[Z_AXIS] = 20.0f;
    double with_20 = corrected_by();
    CHECK(fabs(with_20 - with_120) > 0.002, "%g and %g", with_20, with_120);
    /* G49: unknown again, unless it was set. */
    said_nothing();
    gc_state.modal.tool_offset_mode = ToolLengthOffset_Cancel;
    CHECK(corrected_by() == 0.0 && strstr(said, "bad auxiliary") != NULL, "G49: %s", said);
    CHECK(command("$TRUEAXIS=length 120") == Status_OK, "length");
    CHECK(corrected_by() == with_120, "%g, not %g", corrected_by(), with_120);
    CHECK(command("$TRUEAXIS=LENGTH") == Status_BadNumberFormat, "no length");
    CHECK(command("$TRUEAXIS=LENGTH 12x") == Status_BadNumberFormat, "12x");
    CHECK(command("$TRUEAXIS=LENGTH nan") == Status_BadNumberFormat, "nan");
    CHECK(command("$TRUEAXIS=SIDEWAYS") == Status_InvalidStatement, "sideways");
    /* A temperature outside of its tables is reported once, and its effect stays what it is at the border. While
       corrections are off, it may have become another one. */
    CHECK(command("$TRUEAXIS=OFF") == Status_OK && corrected_by() == 0.0, "off");
    said_nothing();
    CHECK(trueaxis_set_temperature("bed", 60.0f) && corrected_by() == 0.0, "hot, off");
    CHECK(command("$TRUEAXIS=ON") == Status_OK, "on again");
    double hot = corrected_by();
    CHECK(hot != 0.0 && hot != with_120, "%g", hot);
    CHECK(strstr(said, "beyond range") != NULL && strchr(said, '\n') == strrchr(said, '\n'), "%s", said);
    CHECK(trueaxis_set_temperature("bed", 69.0f) && corrected_by() == hot, "%g, not %g", corrected_by(), hot);
    CHECK(command("$TRUEAXIS=OFF") == Status_OK && corrected_by() == 0.0, "off");
    CHECK(trueaxis_set_temperature("bed", 21.0f) && corrected_by() == 0.0, "cold, off");
    CHECK(command("$TRUEAXIS=ON") == Status_OK && corrected_by() == with_120, "as before");
    /* No sensor jumps so far, and no shop is as hot: the sensor fails, which is reported once. */
    said_nothing();
    CHECK(trueaxis_set_temperature("bed", 60.0f), "hot");
    CHECK(corrected_by() == 0.0 && strstr(said, "bad auxiliary") != NULL && strchr(said, '\n') == strrchr(said, '\n'), "%s", said);
    CHECK(trueaxis_set_temperature("bed", 1000.0f) && corrected_by() == 0.0, "implausible");
    /* A sensor fails and recovers. */
    CHECK(trueaxis_set_temperature("bed", NAN) && corrected_by() == 0.0, "lost");
    CHECK(trueaxis_set_temperature("bed", 21.0f) && corrected_by() == with_120, "back");
    /* Homing preserves both. */
    home(0xFF);
    CHECK(corrected_by() == with_120, "after homing");
    /* Nor is anything corrected unless all its axes are homed. */
    start_with(blob("router-10"));
    CHECK(command("$TRUEAXIS=ON") == Status_OK, "on");
    said_nothing();
    CHECK(corrected_by() == 0.0 && strstr(said, "not referenced") != NULL, "not homed: %s", said);
    home(3);
    CHECK(corrected_by() == 0.0, "without Z");
    home(4);
    CHECK(corrected_by() != 0.0, "not corrected");
}
