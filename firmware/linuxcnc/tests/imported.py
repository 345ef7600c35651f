#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""For tests only: takes the place of the user interface, approaches positions from both sides, and writes what each
drive is commanded beyond the position and the homing offset to record.csv: 0 without any compensation.
"""
import os
import sys
import time

import hal
import linuxcnc

ini = linuxcnc.ini(sys.argv[2])  # -ini FILE
folder = os.path.dirname(sys.argv[2])
JOINTS = int(ini.find("KINS", "JOINTS"))
LETTERS = "".join(dict.fromkeys(ini.find("TRAJ", "COORDINATES")))  # of the axes
PLACES = {"X": (12.0, 11.3), "Y": (7.0, 9.1), "Z": (-140.0, 8.7), "A": (-75.0, 9.7)}
command, stat, errors = linuxcnc.command(), linuxcnc.stat(), linuxcnc.error_channel()
component = hal.component("operator")  # pins are read as long as it is there
component.ready()
trueaxis = any(name.endswith("trueaxis.hal") for name in ini.findall("HAL", "HALFILE"))
drive = "trueaxis.joint.%d.motor-cmd-out" if trueaxis else "joint.%d.motor-pos-cmd"


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
    return all(stat.homed[:JOINTS])


def move(position):
    command.mdi("G53 G0 " + " ".join("%s%r" % word for word in zip(LETTERS, position)))
    if command.wait_complete(60) != linuxcnc.RCS_DONE:
        sys.exit("refused: %r" % position)


def still():
    """After a reversal both catch up with bounded rate."""
    last, since = None, time.monotonic()
    while time.monotonic() < since + 0.3:
        now = [hal.get_value(drive % joint) for joint in range(JOINTS)]
        if now != last:
            last, since = now, time.monotonic()
        time.sleep(0.02)


command.state(linuxcnc.STATE_ESTOP_RESET)
command.state(linuxcnc.STATE_ON)
command.wait_complete()
command.mode(linuxcnc.MODE_MANUAL)
command.wait_complete()
command.home(-1)
wait("homing", homed)
command.mode(linuxcnc.MODE_MDI)
command.wait_complete()
if trueaxis:
    hal.set_p("trueaxis.enable", "1")
    wait("compensation", lambda: hal.get_value("trueaxis.factor") == 1)
rows = []
for k in range(16):
    at = [PLACES[letter][0] + PLACES[letter][1] * k for letter in LETTERS]
    for side in (-3.0, 3.0):
        move([q + side for q in at])
        move(at)
        still()
        for joint in range(JOINTS):
            value = lambda pin: hal.get_value("joint.%d.%s" % (joint, pin))
            commanded = hal.get_value(drive % joint) - value("motor-offset")
            rows.append((joint, value("pos-cmd"), side, commanded - value("pos-cmd")))
with open(folder + "/record.csv", "w") as out:
    out.write("joint,position,side,correction\n")
    for row in rows:
        out.write(",".join(repr(value) for value in row) + "\n")
