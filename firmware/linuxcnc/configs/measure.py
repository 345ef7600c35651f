#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Takes the place of the screen: homes, moves, and records what the simulated machine shows.

    DISPLAY = ../measure.py        in [DISPLAY] of the INI file

Every position of demo.ngc is approached twice, first without, then with the compensation. Writes record.csv:
a line now and then along the way, and one with `stop` 1 at each position, when nothing moves any more; x, y and z are
where LinuxCNC's kinematics have the tool.
"""

import re
import sys
import time

import hal
import linuxcnc

command = linuxcnc.command()
stat = linuxcnc.stat()
errors = linuxcnc.error_channel()
shown = ["error", "error-x", "error-y", "error-z", "direction-error"]


def poll():
    """What LinuxCNC is doing; whoever does not fetch its messages makes it wait."""
    stat.poll()
    message = errors.poll()
    if message:
        print(message[1], file=sys.stderr)


def wait(holds, what, seconds=30):
    end = time.time() + seconds
    while not holds():
        if time.time() > end:
            sys.exit("waited in vain: " + what)
        poll()
        time.sleep(0.002)


def homed():
    poll()
    return all(stat.homed[: stat.joints])


def row(stop):
    poll()
    places = [hal.get_value("joint.%d.pos-cmd" % n) for n in range(stat.joints)]
    values = [hal.get_value("trueaxis-model." + name) for name in shown]
    faults = [hal.get_value(name) for name in ("trueaxis.fault", "trueaxis-model.fault")]
    return places + values + [hal.get_value("trueaxis.factor"), int(any(faults)), stop] + list(stat.position[:3])


def move(line, rows):
    command.mdi(line)
    while command.wait_complete(0.004) == -1:
        rows.append(row(0))
    poll()
    if stat.state == linuxcnc.RCS_ERROR:
        sys.exit("refused: " + line)


def main():
    component = hal.component("measure")  # pins are read as long as it is there
    component.ready()
    command.state(linuxcnc.STATE_ESTOP_RESET)
    command.state(linuxcnc.STATE_ON)
    command.wait_complete()
    command.mode(linuxcnc.MODE_MANUAL)
    command.wait_complete()
    command.home(-1)
    wait(homed, "homing")
    command.mode(linuxcnc.MODE_MDI)
    command.wait_complete()
    moves = [line for line in open("demo.ngc").read().split("\n") if re.match("G1 ", line)]
    rows = []
    command.mdi("G21 G90 G94 F6000")
    command.wait_complete()
    for enable in (0, 1):
        hal.set_p("trueaxis.enable", str(enable))
        wait(lambda: hal.get_value("trueaxis.factor") == enable, "factor %d" % enable)
        for line in moves:
            move(line, rows)
            time.sleep(0.05)
            rows.append(row(1))
    with open("record.csv", "w") as out:
        letters = "XYZ" if stat.joints == 3 else "XYZAC"
        out.write(",".join(list(letters) + shown + ["factor", "fault", "stop", "x", "y", "z"]) + "\n")
        for values in rows:
            out.write(",".join(repr(v) for v in values) + "\n")


main()
