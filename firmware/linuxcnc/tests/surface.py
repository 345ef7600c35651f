#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""For tests only: takes the place of the user interface and probes a surface with the corrections on, makes a map of it
with `trueaxis import points`, loads it while the corrections are on, and probes elsewhere; then once more with them off.

Writes the heights that the three probings found, in work coordinates: points.txt, after.txt and off.txt.
"""
import subprocess
import sys
import time

import hal
import linuxcnc

FOLDER = "/tmp/surface/"
OFFSET = (30.0, 20.0, -20.0)
NODES = [(x, y) for y in (0.0, 30.0, 60.0) for x in (-10.0, 30.0, 70.0, 110.0)]
BETWEEN = [(-10.0, 0.0), (12.0, 47.0), (55.0, 20.0), (110.0, 60.0)]
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


def probe(name, places):
    mdi("(PROBEOPEN %s%s)" % (FOLDER, name))
    for x, y in places:
        mdi("G0 Z0.6")
        mdi("G0 X%r Y%r" % (x, y))
        time.sleep(0.2)
        mdi("G38.2 Z-0.8 F30")
    mdi("(PROBECLOSE)")
    mdi("G0 Z5")


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
mdi("G10 L2 P1 X%r Y%r Z%r" % OFFSET)
mdi("G21 G90 G54")
probe("points.txt", NODES)
words = ["/tmp/trueaxis", "import", "points", FOLDER + "points.txt", "--machine", FOLDER + "new/machine.toml"]
words += ["--offset", "X=%r,Y=%r" % OFFSET[:2], "--add-to", FOLDER + "geometry.trax", "-o", FOLDER + "new/machine.trax"]
done = subprocess.run(words, capture_output=True, text=True)
print(done.stdout + done.stderr)
loads = hal.get_value("trueaxis.loads")
hal.set_p("trueaxis.reload", "1")
wait("the map", lambda: hal.get_value("trueaxis.loads") == loads + 1)
# Over the old and the new bound, at the lower ramp rate of both.
wait("the map", lambda: not hal.get_value("trueaxis.fading") and not hal.get_value("trueaxis.fault"), 90)
probe("after.txt", BETWEEN)
mdi("M65 P0")
wait("no compensation", lambda: hal.get_value("trueaxis.factor") == 0)
probe("off.txt", BETWEEN)
