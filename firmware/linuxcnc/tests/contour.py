#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""For tests only: takes the place of the user interface, drives circles at several feeds with the component enabled,
while `tape` records, and writes the rows of each circle to circles.csv: feed, first row, end.
"""
import math
import sys
import time

import hal
import linuxcnc

FEEDS = [600, 1800, 6000]
CENTRE, RADIUS, LEAD = (100.0, 75.0), 30.0, 2.0
command, stat, errors = linuxcnc.command(), linuxcnc.stat(), linuxcnc.error_channel()
component = hal.component("operator")  # pins are read as long as it is there
component.ready()


def wait(what, holds, seconds=30):
    end = time.monotonic() + seconds
    while not holds():
        if time.monotonic() > end:
            sys.exit("waited in vain: " + what)
        time.sleep(0.005)
        stat.poll()
        message = errors.poll()
        if message:
            print(message[1], file=sys.stderr)


def homed():
    stat.poll()
    return all(stat.homed[:3])


def mdi(line):
    command.mdi(line)
    if command.wait_complete(60) != linuxcnc.RCS_DONE:
        sys.exit("refused: " + line)


command.state(linuxcnc.STATE_ESTOP_RESET)
command.state(linuxcnc.STATE_ON)
command.wait_complete()
command.mode(linuxcnc.MODE_MANUAL)
command.wait_complete()
command.home(-1)
wait("homing", homed)
command.mode(linuxcnc.MODE_MDI)
command.wait_complete()
mdi("M64 P0")
wait("compensation", lambda: hal.get_value("trueaxis.factor") == 1)
rows = []
# The circle begins at 45 degrees, clockwise, in the direction in which it is approached.
along = math.sqrt(0.5)
start = [c + RADIUS * along for c in CENTRE]
for feed in FEEDS:
    mdi("G53 G0 X%r Y%r" % (start[0] - 2 * LEAD * along, start[1] + 2 * LEAD * along))
    mdi("G53 G0 X%r Y%r" % (start[0] - LEAD * along, start[1] + LEAD * along))
    mdi("G53 G1 F%d X%r Y%r" % (feed, start[0], start[1]))
    time.sleep(0.3)
    first = hal.get_value("tape.kept")
    hal.set_p("tape.keep", "1")
    mdi("G17 G2 F%d X%r Y%r I%r J%r" % (feed, start[0], start[1], -RADIUS * along, -RADIUS * along))
    time.sleep(0.3)
    hal.set_p("tape.keep", "0")
    time.sleep(0.01)
    rows.append((feed, first, hal.get_value("tape.kept")))
mdi("M65 P0")
wait("compensation", lambda: hal.get_value("trueaxis.factor") == 0)
with open("/tmp/contour/circles.csv", "w") as out:
    out.write("feed,first,end\n")
    for row in rows:
        out.write("%d,%d,%d\n" % row)
