# SPDX-License-Identifier: MIT OR Apache-2.0
"""Drives the LinuxCNC that is running, as another program asks: a line of JSON for each command and each answer.

`trueaxis linuxcnc probe` and `calibrate` start it. Only what needs LinuxCNC's own Python module is here. When the other
program ends, for whatever reason, the machine stops, and what `at_end` names is put back.
"""
import json
import math
import os
import re
import select
import signal
import subprocess
import sys
import time

LETTERS = "XYZABCUVW"
# Pauses between two looks at LinuxCNC, s.
LOOK = 0.002
# An operator who presses stop is noticed by a move that ends elsewhere, mm or degrees.
ELSEWHERE = 1e-4


def answer(**values):
    print(json.dumps(values), flush=True)


def refuse(error, remedy):
    answer(error=error, remedy=remedy)


def ignore_signals():
    """Ctrl-C and the end of the terminal are for the other program, whose end is the end of the input."""
    for one in (signal.SIGINT, signal.SIGHUP, signal.SIGTERM):
        signal.signal(one, signal.SIG_IGN)


ignore_signals()
try:
    import hal
    import linuxcnc

    # hal has handlers of its own.
    ignore_signals()
except ImportError as missing:
    refuse("Python finds no LinuxCNC: %s" % missing, "install linuxcnc-uspace, and run this on the computer of the machine")
    sys.exit(1)

command, stat, errors = linuxcnc.command(), linuxcnc.stat(), linuxcnc.error_channel()


class Stopped(Exception):
    """The other program has ended or changed its mind."""


class Refused(Exception):
    """A command that LinuxCNC did not do: why, and what to do about it."""


def is_called():
    return bool(select.select([sys.stdin], [], [], 0)[0])


def messages():
    """What LinuxCNC tells its operator."""
    said = []
    while True:
        message = errors.poll()
        if not message:
            return said
        if message[0] in (linuxcnc.NML_ERROR, linuxcnc.OPERATOR_ERROR):
            said.append(message[1].strip())


def is_held():
    """True while the operator holds the machine: that may take as long as it wants."""
    return stat.paused or stat.feedrate == 0 or stat.task_paused


def wait(holds, what, seconds):
    end = time.monotonic() + seconds
    while True:
        stat.poll()
        if holds():
            return
        if is_called():
            raise Stopped()
        if time.monotonic() > end:
            raise Refused("LinuxCNC does not get there: %s" % what, "look at its screen")
        time.sleep(LOOK)


def to_mode(mode):
    stat.poll()
    if stat.task_mode != mode:
        command.mode(mode)
        command.wait_complete()
        wait(lambda: stat.task_mode == mode, "its mode", 10)


def finish(line, seconds):
    """Waits until a command is done, longer while the operator holds the machine. Returns whether it is: False if
    LinuxCNC reports an error without a message, which was seen on a very busy computer."""
    said = []
    end = time.monotonic() + seconds
    while True:
        done = command.wait_complete(0.01)
        stat.poll()
        said += messages()
        if done == linuxcnc.RCS_ERROR or said:
            command.abort()
            command.wait_complete()
            # A message may come after the error.
            time.sleep(0.2)
            said += messages()
            if not said:
                return False
            why = "; ".join(said)
            if "tripped" in why:
                remedy = "the stylus met something on its way: check its length and diameter, and where the balls are"
            else:
                remedy = "look at the machine, then start again"
            raise Refused("%s: %s" % (line, why), remedy)
        still = stat.interp_state == linuxcnc.INTERP_IDLE and stat.inpos and stat.queue == 0
        if done == linuxcnc.RCS_DONE and still:
            return True
        if is_called():
            raise Stopped()
        if is_held():
            end = time.monotonic() + seconds
        elif time.monotonic() > end:
            command.abort()
            raise Refused("%s: not done after %d s" % (line, seconds), "look at the machine, then start again")


def mdi(line, seconds=600):
    """A line, or a function that makes it from where the machine stands, for a move that can be repeated."""
    stat.poll()
    if stat.task_state != linuxcnc.STATE_ON:
        raise Refused("the machine is off", "switch it on, and start again: what was probed stays")
    if stat.task_mode != linuxcnc.MODE_MDI:
        raise Refused("the operator has taken the machine over", "start again: what was probed stays")
    messages()
    makes = line if callable(line) else lambda: line
    # A move to a machine position can be repeated, too.
    for _ in range(3 if callable(line) or line.startswith("G53 ") else 1):
        made = makes()
        command.mdi(made)
        if finish(made, seconds):
            return
    raise Refused("%s: refused without a message" % made, "look at the machine, then start again")


def in_mm(position):
    """A position of LinuxCNC, by axis letter, in mm and degrees."""
    found = {}
    for number, letter in enumerate(LETTERS):
        if stat.axis_mask & 1 << number:
            unit = stat.angular_units if letter in "ABC" else stat.linear_units
            found[letter] = position[number] / unit
    return found


def words(target):
    return "".join(" %s%.6f" % (letter, value) for letter, value in target.items())


def check(target, at):
    away = max(abs(at[letter] - value) for letter, value in target.items())
    if away > ELSEWHERE:
        raise Refused(
            "a move ended %.4f from its end: somebody stopped it" % away, "start again: what was probed stays"
        )


def state(_):
    """What LinuxCNC is doing."""
    stat.poll()
    return {
        "ini": os.path.abspath(stat.ini_filename),
        "date": time.strftime("%Y-%m-%d-%H%M%S"),
        "is_on": stat.task_state == linuxcnc.STATE_ON,
        "homed": all(stat.homed[: stat.joints]),
    }


def home(asked):
    """Homes all joints."""
    stat.poll()
    if stat.task_state != linuxcnc.STATE_ON:
        raise Refused("the machine is off", "switch it on")
    driven.append("home")
    to_mode(linuxcnc.MODE_MANUAL)
    command.teleop_enable(0)
    command.wait_complete()
    command.home(-1)
    wait(lambda: all(stat.homed[: stat.joints]), "home", asked["seconds"])
    return state(asked)


def begin(_):
    """MDI, with the words that the moves rely on; what the operator had is put back at the end."""
    stat.poll()
    if stat.task_state != linuxcnc.STATE_ON:
        raise Refused("the machine is off", "switch it on")
    if not all(stat.homed[: stat.joints]):
        raise Refused("the machine is not homed", "home it")
    if stat.interp_state != linuxcnc.INTERP_IDLE:
        raise Refused("a program is running", "wait until it ends")
    driven.append("begin")
    to_mode(linuxcnc.MODE_MDI)
    mdi("M70")
    modes.append("M72")
    mdi("G21 G90 G94 G17 G40 G80")
    return state(_)


def halcmd(*asked):
    return subprocess.run(("halcmd", "-s") + asked, capture_output=True, text=True).stdout


def by_program():
    """The line that switches kinematics by an analogue output: its number is that of the pin on the same signal."""
    wired = halcmd("show", "pin", "motion.switchkins-type").split()
    signal_name = wired[-1] if len(wired) > 5 else ""
    output = re.search(r"motion\.analog-out-(\d+)", halcmd("show", "sig", signal_name)) if signal_name else None
    return ["M68 E%d Q%%d" % int(output[1])] if output else []


def joints(asked):
    """Kinematics in which every axis is a joint, until the end; what was in force comes back then. With `look`, only the
    line that would switch them."""
    named = linuxcnc.ini(stat.ini_filename).find("KINS", "KINEMATICS") or ""
    if named.split()[:1] == ["trivkins"]:
        return {"changed": None}
    kinds = {}
    for kind in range(3):
        try:
            kinds[kind] = hal.get_value("kinstype.is-%d" % kind)
        except RuntimeError:
            pass
    # LinuxCNC's own modules: their kinematics first and identity second, or as `identityfirst` says.
    wanted = 0 if "identityfirst" in named else 1
    if wanted not in kinds:
        raise Refused(
            "the kinematics %s cannot be switched to identity" % named, "probe with trivkins, or with a module that switches"
        )
    before = next((kind for kind, is_on in kinds.items() if is_on), None)
    if before == wanted:
        return {"changed": None}
    remaps = linuxcnc.ini(stat.ini_filename).findall("RS274NGC", "REMAP")
    codes = [remap.split()[0].upper() for remap in remaps]
    lines = by_program() or [code for code in ("M429", "M428", "M430") if code in codes]
    if asked.get("look") and lines:
        return {"changed": lines[0] % wanted if "%" in lines[0] else lines[0]}
    for line in lines:
        mdi(line % wanted if "%" in line else line)
        wait(lambda: True, "", 1)
        if hal.get_value("kinstype.is-%d" % wanted):
            if "%" in line:
                modes.append(line % before)
            return {"changed": line % wanted if "%" in line else line}
    raise Refused(
        "nothing switches the kinematics to identity",
        "write `net kinematics motion.analog-out-03 => motion.switchkins-type` into a HAL file",
    )


def run(asked):
    """A line of G-code."""
    mdi(asked["line"])
    return {}


def move(asked):
    """To machine positions; the stylus must be clear."""
    if asked.get("clear", True):
        stat.poll()
        if stat.probe_val:
            raise Refused("the probe is tripped before a move", "free the stylus, look at its battery and cable")
    target = asked["target"]
    feed = "G0%s" % words(target) if asked.get("feed") is None else "G1%s F%g" % (words(target), asked["feed"])
    mdi("G53 " + feed)
    check(target, in_mm(stat.position))
    return {}


def touch(asked):
    """From the end of the last move towards a machine position, until the probe trips."""
    stat.poll()
    if stat.probe_val:
        raise Refused("the probe is tripped before a touch", "free the stylus, look at its battery and cable")

    def towards():
        stat.poll()
        at = in_mm(stat.position)
        way = {letter: value - at[letter] for letter, value in asked["target"].items()}
        # Incremental words are turned by the rotation of the work offset.
        turn = math.radians(-stat.rotation_xy)
        x, y = way.get("X", 0.0), way.get("Y", 0.0)
        if turn:
            way["X"], way["Y"] = x * math.cos(turn) - y * math.sin(turn), x * math.sin(turn) + y * math.cos(turn)
        return "G91 G38.3%s F%g" % (words(way), asked["feed"])

    mdi(towards)
    tripped = bool(stat.probe_tripped)
    probed = in_mm(stat.probed_position)
    ended = in_mm(stat.position)
    mdi("G90")
    if not tripped:
        check(asked["target"], ended)
    return {"tripped": tripped, "position": probed, "time": time.time()}


def pins(asked):
    """Values of pins; null for one that is not there."""
    found = {}
    for name in asked["names"]:
        try:
            value = hal.get_value(name)
            found[name] = None if isinstance(value, float) and not math.isfinite(value) else value
        except RuntimeError:
            found[name] = None
    return {"pins": found}


def set_pins(asked):
    """Sets pins that nothing else drives; with `back` they are put back at the end."""
    for name, value in asked["pins"].items():
        try:
            before = hal.get_value(name)
            hal.set_p(name, "%.12g" % value)
        except RuntimeError as error:
            raise Refused("%s: %s" % (name, error), "take the line that connects this pin out of the HAL files")
        if asked.get("back"):
            pins_before.setdefault(name, before)
    return {}


def reload(component, seconds=20):
    """Lets the component read its file, while the corrections are out; says why it does not take it, or 0."""
    hal.set_p(component + ".enable", "0")
    wait(lambda: hal.get_value(component + ".factor") == 0, "the corrections do not fade out", seconds)
    answered = hal.get_value(component + ".reloads")
    level = False

    def is_answered():
        # An edge counts when the servo thread has seen both levels, which can take long on a busy computer.
        nonlocal level
        level = not level
        hal.set_p(component + ".reload", str(int(level)))
        return hal.get_value(component + ".reloads") != answered

    wait(is_answered, "the file is not read", seconds)
    hal.set_p(component + ".reload", "0")
    wait(lambda: not hal.get_value(component + ".loading"), "the file is not read", seconds)
    return hal.get_value(component + ".load-fault")


def put(path, contents):
    """Replaces a file at once; None removes it."""
    if contents is None:
        if os.path.exists(path):
            os.remove(path)
        return
    with open(path + ".new", "wb") as new:
        new.write(contents)
        new.flush()
        os.fsync(new.fileno())
    os.replace(path + ".new", path)


def load(asked):
    """Puts a file in the place of the compensation, and lets the component read it; at the end the old one returns."""
    path, component = asked["path"], asked["component"]
    contents = open(asked["file"], "rb").read()
    before = open(path, "rb").read() if os.path.exists(path) else None
    set_pins({"pins": {component + ".enable": 0}, "back": True})
    if path not in files_before:
        files_before[path] = (component, before)
    put(path, contents)
    fault = reload(component)
    if fault:
        raise Refused("the component does not take the file: fault %d" % fault, "`man trueaxis` explains the number")
    return {}


def keep(_):
    """Pins and files stay as they are."""
    pins_before.clear()
    files_before.clear()
    return {}


def putting_back():
    """What puts back files, then pins."""
    undone = []
    for path, (component, contents) in files_before.items():
        undone += [lambda p=path, c=contents: put(p, c), lambda c=component: reload(c)]
    for name, value in pins_before.items():
        undone.append(lambda n=name, v=value: hal.set_p(n, str(int(v) if isinstance(v, bool) else v)))
    return undone


def undo(_):
    """Puts back pins and files as they were before the first change."""
    for one in putting_back():
        one()
    return keep(_)


def stand():
    """Waits until the machine stands."""
    wait(lambda: stat.inpos and all(abs(joint["velocity"]) < 1e-6 for joint in stat.joint[: stat.joints]), "it does not stop", 10)


def end():
    """Stops, waits until the machine stands, and puts back what was changed, last first."""
    if driven:
        command.abort()
        command.wait_complete()
    for one in [stand] * bool(driven) + putting_back() + [lambda line=line: mdi(line) for line in reversed(modes)]:
        try:
            one()
        except (Refused, RuntimeError, OSError, linuxcnc.error) as error:
            print("trueaxis: %s" % (error.args[0],), file=sys.stderr)


# What has moved the machine; lines that put modes back, and pins and files as they were.
driven = []
modes, pins_before, files_before = [], {}, {}
components = []
DO = {f.__name__: f for f in (state, home, begin, joints, run, move, touch, pins, set_pins, load, keep, undo)}


def main():
    try:
        stat.poll()
        # Pins can be read and set as long as it is there.
        components.append(hal.component("trueaxis-session-%d" % os.getpid()))
        components[0].ready()
    except (linuxcnc.error, RuntimeError) as error:
        refuse("LinuxCNC is not running: %s" % error, "start it, on this computer and as this user")
        return
    answer(**state(None))
    for line in sys.stdin:
        asked = json.loads(line)
        try:
            answer(**DO[asked["do"]](asked))
        except Refused as refused:
            refuse(*refused.args)
        except linuxcnc.error as error:
            refuse("LinuxCNC has ended: %s" % error, "start it again")
        except (OSError, RuntimeError) as error:
            refuse(str(error), "look at the cause, then start again")


try:
    main()
except (Stopped, BrokenPipeError, KeyboardInterrupt):
    pass
finally:
    # The end of the input has been seen; what follows is done to its end.
    is_called = lambda: False
    end()
