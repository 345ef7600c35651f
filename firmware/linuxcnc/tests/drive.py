#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""For tests only: takes the place of the user interface, and drives the machine as /tmp/scenario says.

What it finds goes to /tmp/result, a name and values in each line, with tabs; when it ends, LinuxCNC ends.
"""
import os
import random
import shutil
import subprocess
import time
import traceback

import hal
import linuxcnc

DEMOS = (
    "/usr/share/doc/linuxcnc/examples/sample-configs/sim/axis/vismach/5axis/table-rotary-tilting/demos"
)
command, status, errors = linuxcnc.command(), linuxcnc.stat(), linuxcnc.error_channel()
result = open("/tmp/result", "w")


def tell(name, *values):
    print(name, *(repr(v) for v in values), sep="\t", file=result, flush=True)


def halcmd(*words):
    return subprocess.run(("halcmd",) + words, check=True, capture_output=True, text=True).stdout.strip()


def pin(name):
    return halcmd("getp", name)


def set_pin(name, value):
    halcmd("setp", name, str(value))


def messages_with_kinds():
    """Messages to the operator. LinuxCNC waits until they are fetched."""
    said = []
    while True:
        message = errors.poll()
        if not message:
            return said
        if "following error" in message[1]:
            raise RuntimeError(message[1])
        said.append(message)


def messages():
    return [text for _, text in messages_with_kinds()]


def wait(what, holds, seconds=30):
    end = time.monotonic() + seconds
    while not holds():
        if time.monotonic() > end:
            raise RuntimeError("no " + what)
        time.sleep(0.005)
        status.poll()
        messages()


def settled(mode):
    command.mode(mode)
    command.wait_complete()


def start():
    """Out of emergency stop, on, homed."""
    status.poll()
    command.state(linuxcnc.STATE_ESTOP_RESET)
    command.wait_complete()
    command.state(linuxcnc.STATE_ON)
    command.wait_complete()
    settled(linuxcnc.MODE_MANUAL)


def home():
    command.home(-1)
    wait("homing", lambda: all(status.homed[:5]))
    # Homed joint by joint, then driven axis by axis.
    command.teleop_enable(1)
    command.wait_complete()


def mdi(text, seconds=60):
    settled(linuxcnc.MODE_MDI)
    command.mdi(text)
    done = command.wait_complete(seconds)
    if done != linuxcnc.RCS_DONE:
        raise RuntimeError("%s: %r %r" % (text, done, messages()))


def in_force():
    wait("compensation", lambda: pin("trueaxis.factor") == "1")


# Those that come with LinuxCNC for this machine, with the maximum time for each in seconds; except
# xyzac_switchkins, which moves in machine coordinates beyond the travel of this machine. The second test goes to
# C360, the end of the travel, where corrections are held and differ from `eval`, so it runs up to the line before.
PROGRAMS = (
    ("boat-xyzac", 20, None),
    ("impeller-7bl-xyzac", 20, None),
    ("xyzac_switchkins_test_1", 20, None),
    ("xyzac_switchkins_test_2", 20, 35),
    ("xyzac_switchkins_test_3", 20, None),
)


def drive(name, seconds, last):
    """As far as the time permits: the longest take minutes."""
    # Left on by an earlier one.
    mdi("G94 G90 G21 G17")
    settled(linuxcnc.MODE_AUTO)
    command.program_open("%s/%s.ngc" % (DEMOS, name))
    kept = int(pin("tape.kept"))
    began = time.monotonic()
    command.auto(linuxcnc.AUTO_RUN, 0)
    time.sleep(0.2)
    furthest = 0
    while True:
        status.poll()
        said = [text for kind, text in messages_with_kinds() if kind in (linuxcnc.NML_ERROR, linuxcnc.OPERATOR_ERROR)]
        if said:
            raise RuntimeError("%s: %r" % (name, said))
        furthest = max(furthest, status.motion_line)
        ended = status.interp_state == linuxcnc.INTERP_IDLE
        if ended or time.monotonic() > began + seconds or (last and furthest >= last):
            break
        time.sleep(0.02)
    command.abort()
    command.wait_complete()
    tell("program " + name, furthest, int(ended), int(pin("tape.kept")) - kept)
    mdi("M429")


def programs():
    """The demonstrations that come with LinuxCNC, as seen by the motion controller."""
    start()
    set_pin("trueaxis.enable", 1)
    # Homed with the compensation configured and enabled: it ramps in by itself.
    home()
    in_force()
    tell("offsets", *(float(pin("joint.%d.motor-offset" % j)) for j in range(5)))
    mdi("G10 L2 P1 X200 Y150 Z-180 A0 C0")
    command.feedrate(50.0)
    command.set_optional_stop(False)
    # Without gaps: each row is compared with the previous one.
    set_pin("tape.keep", 1)
    for name, seconds, last in PROGRAMS:
        drive(name, seconds, last)
    set_pin("tape.keep", 0)
    for name in ("trueaxis.read", "trueaxis.write", "rivals.matrix", "rivals.kins", "rivals.nothing"):
        tell("tmax " + name, int(pin(name + ".tmax")))


def probe():
    """A fixed surface on the workpiece: the probe trips when the real tool tip is beyond it."""
    command.feedrate(1.0)
    mdi("G94 G90 G21")
    mdi("G53 G0 X150 Y250 Z-60 A20 C10")
    surface = float(pin("trueaxis-model.tip-x")) + 10.0
    set_pin("surface.in0", surface)
    mdi("G54 G10 L2 P1 X0 Y0 Z0 A0 C0")
    mdi("G38.2 X190 F60")
    status.poll()
    tell("probed", int(status.probe_tripped), *(status.probed_position[k] for k in (0, 1, 2, 3, 5)))
    tell("surface", surface)
    mdi("G53 G0 X150")


def touches():
    """A program that probes balls simulated in HAL."""
    start()
    home()
    settled(linuxcnc.MODE_AUTO)
    command.program_open("/tmp/probe.ngc")
    command.feedrate(1.0)
    command.auto(linuxcnc.AUTO_RUN, 0)
    # On busy processors it takes longer than it should: it hangs if a line takes a minute. Between two touches it may
    # seem to be at its end for a moment: it is after half a second.
    line, since, idle = None, time.monotonic(), 0
    while idle < 100:
        if status.motion_line != line:
            line, since = status.motion_line, time.monotonic()
        if time.monotonic() > since + 60:
            raise RuntimeError("no end of the program: line %r" % line)
        time.sleep(0.005)
        status.poll()
        idle = idle + 1 if status.interp_state == linuxcnc.INTERP_IDLE else 0
        for text in messages():
            tell("said", text)


def limits():
    """In the corners of the travel, and beyond."""
    set_pin("surface.in0", 1e9)
    for name, corner in (("lower", "X0 Y0 Z-250 A-100 C-360"), ("upper", "X400 Y300 Z0 A100 C360")):
        mdi("G53 G0 " + corner)
        time.sleep(0.5)
        for j in range(5):
            joint = "trueaxis.joint.%d." % j
            tell("corner", name, j, float(pin(joint + "pos-in")), float(pin(joint + "correction")))
    try:
        mdi("G53 G0 X400.001")
        tell("beyond", 1)
    except RuntimeError:
        tell("beyond", 0)


def events(count=1000):
    """Whatever an operator can do, at any moment."""
    chance = random.Random(1)
    happened = {}

    def enable():
        pins["enable"] = chance.random() < 0.7

    def dry_run():
        pins["dry-run"] = chance.random() < 0.2

    def reload():
        name = chance.choice(["first", "first", "second", "second", "third", "fourth", None])
        if name is None:
            os.path.exists("/tmp/machine.trax") and os.remove("/tmp/machine.trax")
        else:
            shutil.copy("/tmp/%s.trax" % name, "/tmp/next.trax")
            os.replace("/tmp/next.trax", "/tmp/machine.trax")
        pins["reload"] = 0
        time.sleep(0.003)
        pins["reload"] = 1

    def home_one_or_all():
        command.mode(linuxcnc.MODE_MANUAL)
        command.teleop_enable(0)
        command.unhome(chance.choice([-1, 0, 2, 4]))
        command.home(-1)

    def move():
        command.mode(linuxcnc.MODE_MDI)
        corner = [chance.choice([0, 400, 137]), chance.choice([0, 300, 77]), chance.choice([-250, 0, -31])]
        command.mdi("G53 G0 X%d Y%d Z%d A%d C%d" % (*corner, chance.randint(-90, 90), chance.randint(-300, 300)))

    def program():
        command.mode(linuxcnc.MODE_AUTO)
        command.program_open(DEMOS + "/boat-xyzac.ngc")
        command.auto(linuxcnc.AUTO_RUN, 0)

    def jog():
        command.mode(linuxcnc.MODE_MANUAL)
        command.teleop_enable(0)
        joint = chance.randrange(5)
        command.jog(linuxcnc.JOG_CONTINUOUS, True, joint, chance.choice([-80, 80]))
        time.sleep(0.05)
        command.jog(linuxcnc.JOG_STOP, True, joint)

    def abort():
        command.abort()

    def estop():
        command.state(linuxcnc.STATE_ESTOP)

    def machine_off():
        command.state(linuxcnc.STATE_OFF)

    def machine_on():
        command.state(linuxcnc.STATE_ESTOP_RESET)
        command.state(linuxcnc.STATE_ON)

    often = {enable: 9, dry_run: 2, reload: 7, home_one_or_all: 1, move: 9, program: 2, jog: 2, abort: 4, estop: 1,
             machine_off: 1}
    pins = hal.component("operator")
    for name in ("enable", "dry-run", "reload"):
        pins.newpin(name, hal.HAL_BIT, hal.HAL_OUT)
    pins.ready()
    for name in ("enable", "dry-run", "reload"):
        halcmd("net", "operator-" + name, "operator." + name, "trueaxis." + name)
    start()
    pins["enable"] = 1
    home()
    in_force()
    mdi("G10 L2 P1 X200 Y150 Z-180 A0 C0")
    halcmd("setp", "tape.keep", "1")
    for _ in range(count):
        event = chance.choices(list(often), list(often.values()))[0]
        event()
        happened[event.__name__] = happened.get(event.__name__, 0) + 1
        # Usually in quick succession, sometimes with time to finish.
        time.sleep(chance.choices([0.0, 0.01, 0.02, 0.6], [6, 6, 3, 1])[0])
        status.poll()
        messages()
        if status.task_state != linuxcnc.STATE_ON and chance.random() < 0.5:
            machine_on()
        elif status.task_state == linuxcnc.STATE_ON and not all(status.homed[:5]) and chance.random() < 0.3:
            command.abort()
            settled(linuxcnc.MODE_MANUAL)
            command.teleop_enable(0)
            command.home(-1)
            time.sleep(0.3)
    halcmd("setp", "tape.keep", "0")
    tell("events", count)
    for name, number in happened.items():
        tell("count " + name, number)


def main():
    scenario = open("/tmp/scenario").read().split()
    for part in scenario:
        globals()[part]()
    tell("done", True)


try:
    main()
except Exception:
    tell("failed", traceback.format_exc(), messages())
