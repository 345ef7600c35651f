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

/* A bed with a lag of 64 s, whose reading is followed at 0.1 K/s. Temperatures follow the clock, at standstill, too. */
static void heat(void)
{
    start_with(blob("lag"));
    for (size_t i = 0; i < N_AXIS; i++)
        settings.axis[i].steps_per_mm *= 64.0f; /* for corrections to show */
    home(0xFF);
    CHECK(command("$TRUEAXIS=LENGTH 130") == Status_OK && command("$TRUEAXIS=ON") == Status_OK, "on");
    CHECK(trueaxis_set_temperature("bed", 20.0f), "bed");
    double cold = corrected_by();
    wait_for(30.0); /* for the moves to end by the clock, too */
    CHECK(trueaxis_set_temperature("bed", 26.0f), "bed");
    wait_for(64.0);
    double warm = corrected_by();
    home(0xFF);
    double again = corrected_by();
    wait_for(1200.0);
    double hot = corrected_by();
    /* After 60 s of 0.1 K/s and 4 s at 6 K the lag is at 2.34 K, after another 13 s, which the moves take, at 2.82 K; and
       after the same again at 3.6 K. Homing would start it at the reading. */
    double share = (warm - cold) / (hot - cold);
    CHECK(share > 2.34 / 6.0 && share < 2.82 / 6.0, "%g", share);
    share = (again - cold) / (hot - cold);
    CHECK(share > 2.34 / 6.0 && share < 3.6 / 6.0, "after homing: %g", share);
    /* A second counts once, whether moves or the clock show it: seven times as many moves, which take 8 s each, and as long
       by the clock. Both added would be at 4.5 K. */
    start_with(blob("lag"));
    for (size_t i = 0; i < N_AXIS; i++)
        settings.axis[i].steps_per_mm *= 64.0f;
    home(0xFF);
    CHECK(command("$TRUEAXIS=ON") == Status_OK && trueaxis_set_temperature("bed", 20.0f), "again");
    CHECK(fabs(corrected_by() - cold) < 1e-4, "cold again");
    wait_for(30.0);
    CHECK(trueaxis_set_temperature("bed", 26.0f), "bed");
    for (int times = 0; times < 7; times++) {
        corrected_by();
        wait_for(8.0);
    }
    share = (corrected_by() - cold) / (hot - cold);
    CHECK(share > 2.0 / 6.0 && share < 3.4 / 6.0, "moves and clock: %g", share);
    /* A machine that warms up by 15 K without a move is no failing sensor. */
    said_nothing();
    for (int second = 0; second < 300; second++) {
        CHECK(trueaxis_set_temperature("bed", 20.0f + 0.05f * (float)second), "bed");
        wait_for(1.0);
    }
    CHECK(corrected_by() != 0.0 && strstr(said, "bad") == NULL, "%s", said);
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
    /* A tool that was touched off is by so much longer than the reference tool, whose length must be known. */
    sys.tlo_reference_set.mask = bit(Z_AXIS);
    gc_state.modal.tool_offset_mode = ToolLengthOffset_EnableDynamic;
    gc_state.modal.tool_length_offset[Z_AXIS] = -100.0f;
    CHECK(corrected_by() == 0.0, "a reference of unknown length");
    CHECK(command("$TRUEAXIS=length 120") == Status_OK, "length");
    CHECK(corrected_by() == with_20, "%g, not %g", corrected_by(), with_20);
    sys.tlo_reference_set.mask = 0;
    CHECK(corrected_by() == with_20, "homing forgets the reference: %g, not %g", corrected_by(), with_20);
    gc_state.modal.tool_offset_mode = ToolLengthOffset_Cancel;
    CHECK(corrected_by() == with_120, "%g, not %g", corrected_by(), with_120);
    /* G43.1 without a reference tool. */
    gc_state.modal.tool_offset_mode = ToolLengthOffset_EnableDynamic;
    gc_state.modal.tool_length_offset[Z_AXIS] = 20.0f;
    CHECK(corrected_by() == with_20, "%g, not %g", corrected_by(), with_20);
    gc_state.modal.tool_offset_mode = ToolLengthOffset_Cancel;
    CHECK(command("$TRUEAXIS=LENGTH") == Status_BadNumberFormat, "no length");
    CHECK(command("$TRUEAXIS=LENGTH 12x") == Status_BadNumberFormat, "12x");
    CHECK(command("$TRUEAXIS=LENGTH nan") == Status_BadNumberFormat, "nan");
    CHECK(command("$TRUEAXIS=ON off please") == Status_InvalidStatement, "extra words");
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
    heat();
}
