# SPDX-License-Identifier: MIT
# Copyright (c) 2026 The trueaxis maintainers. The licence is in LICENSE-MIT.
"""A tab of LinuxCNC's screen for the component trueaxis: what it does, and the switches of the operator.

    [DISPLAY]
    EMBED_TAB_NAME = Compensation
    EMBED_TAB_COMMAND = gladevcp -c trueaxis-panel -x {XID} -u FOLDER/trueaxis_panel.py FOLDER/trueaxis-panel.ui

It reads and sets the pins of the component, as `trueaxis control --hal` does. It has no pins of its own, so a button of
the machine may drive trueaxis.enable instead; the panel then only shows it.
"""
import glob
import json
import math
import os
import re
import shlex
import signal
import subprocess
import time

import gi

gi.require_version("Gtk", "3.0")
from gi.repository import Gdk, GLib, Gtk

import hal
import linuxcnc

# Values of the pins `state` and `fault-code`, as in `trueaxis monitor --hal`.
STATES = [
    "active",
    "enable is off",
    "dry run",
    "joint {} is not homed",
    "joint {} is homing",
    "a fault",
    "fading in",
    "no file has been read yet",
]
FAULTS = [
    "none",
    "the file cannot be read",
    "the file is damaged, of another format or too large",
    "the axes of the file differ from axes=",
    "the file needs more temperature pins",
    "the file was not accepted while corrections are active: disable, reload, enable",
    "pos-in of a joint is not connected",
    "tool-length is not connected",
    "a temperature is not connected",
    "a weight is outside its limits",
    "the period of the thread is not from 1 µs to 10 ms",
    "a position is out of reach, or a temperature is implausible",
    "a bug in the library: please report it",
]
# Colour of each state: in, out, on its way, wrong.
COLOURS = ["in", "out", "out", "way", "way", "wrong", "way", "way"]
PERIOD_MS = 100
# The longest that reading a file takes, in periods.
LONGEST = 100
STYLE = b"""
.state { border-radius: 6px; }
.state label { color: white; }
.in { background: #2e7d32; } .out { background: #546e7a; } .way { background: #b26a00; } .wrong { background: #b71c1c; }
.title { font-size: 150%; font-weight: bold; }
.axis { font-size: 125%; font-weight: bold; }
.number { font-family: monospace; }
.dim { opacity: 0.7; }
.on { background: #1565c0; } .on label { color: white; }
"""


def pin(name):
    """Value of a pin of the component; None if there is no such pin."""
    try:
        return hal.get_value("trueaxis." + name)
    except RuntimeError:
        return None


def is_driven(name):
    """Whether something else writes to a pin."""
    return bool(hal.pin_has_writer("trueaxis." + name))


def set_pin(name, value):
    """Sets a pin, or the signal on it if nothing writes to that."""
    shown = subprocess.run(["halcmd", "-s", "show", "pin", "trueaxis." + name], capture_output=True, text=True).stdout
    words = next((line.split() for line in shown.splitlines() if line.split()[4:5] == ["trueaxis." + name]), [])
    command = ["sets", words[6]] if len(words) > 6 else ["setp", "trueaxis." + name]
    subprocess.run(["halcmd"] + command + [str(value)], check=False)


class Configuration:
    """What the INI and HAL files say about the component."""

    def __init__(self, path):
        self.path = path
        self.folder = os.path.dirname(path)
        self.ini = linuxcnc.ini(path)
        options = dict(word.split("=", 1) for word in self.loaded().split() if "=" in word)
        self.letters = options.get("axes", "")
        self.file = os.path.join(self.folder, options["file"]) if "file" in options else None
        # Machine units per mm.
        units = (self.ini.find("TRAJ", "LINEAR_UNITS") or "mm").lower()
        self.mm = 1.0 if units in ("mm", "metric") else 1 / 25.4

    def loaded(self):
        """The options of `loadrt trueaxis`."""
        for named in self.ini.findall("HAL", "HALFILE") or []:
            try:
                with open(os.path.join(self.folder, named.split()[0])) as lines:
                    text = lines.read().replace("\\\n", " ")
            except (OSError, IndexError):
                continue
            found = re.search(r"^\s*loadrt\s+trueaxis\s+([^#\n]*)", text, re.M)
            if found:
                value = lambda entry: self.ini.find(*entry.groups()) or ""
                return re.sub(r"\[(\w+)\]\(?(\w+)\)?", value, found[1])
        return ""

    def letter(self, joint):
        return self.letters[joint : joint + 1]

    def can_calibrate(self):
        """Whether the machine has rotary axes and a probe, or its owner says how to calibrate it."""
        has_rotary = any(letter in self.letters for letter in "ABC")
        return bool(self.ini.find("TRUEAXIS", "CALIBRATE")) or has_rotary and hal.pin_has_writer("motion.probe-input")

    def calibrate(self):
        """The command that calibrates."""
        found = self.ini.find("TRUEAXIS", "CALIBRATE")
        return found or "trueaxis linuxcnc calibrate machine.toml --artefact artefact.toml --ball-diameter 20 --stylus-diameter 6"

    def last_calibration(self):
        """Folder, date and contents of the newest validation, or None."""
        found = glob.glob(os.path.join(self.folder, "*", "validation.json"))
        found = sorted((os.path.getmtime(path), path) for path in found)
        try:
            when, path = found[-1]
            with open(path) as text:
                return os.path.basename(os.path.dirname(path)), time.localtime(when), json.load(text)
        except (IndexError, OSError, ValueError):
            return None


class Bar(Gtk.DrawingArea):
    """A value between -1 and 1, or between 0 and 1, with a second one as a mark."""

    def __init__(self, is_signed):
        super().__init__()
        self.is_signed, self.value, self.mark, self.is_limited = is_signed, 0.0, None, False
        self.set_size_request(160, 20)
        self.set_hexpand(True)
        self.set_valign(Gtk.Align.CENTER)
        self.connect("draw", self.draw)

    def show_value(self, value, mark=None, is_limited=False):
        if (value, mark, is_limited) != (self.value, self.mark, self.is_limited):
            self.value, self.mark, self.is_limited = value, mark, is_limited
            self.queue_draw()

    def place(self, value, width):
        value = max(-1.0, min(1.0, value))
        return width * ((value + 1) / 2 if self.is_signed else value)

    def draw(self, _, context):
        width, height = self.get_allocated_width(), self.get_allocated_height()
        context.set_source_rgb(0.87, 0.89, 0.91)
        context.rectangle(0, 0, width, height)
        context.fill()
        zero, end = self.place(0, width), self.place(self.value, width)
        colour = (0.72, 0.11, 0.11) if self.is_limited else (0.08, 0.40, 0.75)
        context.set_source_rgb(*colour)
        context.rectangle(min(zero, end), 3, abs(end - zero), height - 6)
        context.fill()
        if self.is_signed:
            context.set_source_rgb(0.35, 0.35, 0.35)
            context.rectangle(zero - 0.5, 0, 1, height)
            context.fill()
        if self.mark is not None:
            at = self.place(self.mark, width)
            context.set_source_rgb(0.1, 0.1, 0.1)
            context.set_line_width(1)
            context.rectangle(min(zero, at) + 0.5, 3.5, abs(at - zero) - 1, height - 7)
            context.stroke()


def add_class(widget, name):
    widget.get_style_context().add_class(name)


def remove_class(widget, name):
    widget.get_style_context().remove_class(name)


def label(text="", style=None, right=False):
    made = Gtk.Label(label=text, xalign=1.0 if right else 0.0)
    if style:
        add_class(made, style)
    return made


class Panel:
    """The widgets, and what they show."""

    def __init__(self, builder):
        self.configuration = Configuration(os.environ["INI_FILE_NAME"])
        self.box = builder.get_object("panel")
        style = Gtk.CssProvider()
        style.load_from_data(STYLE)
        Gtk.StyleContext.add_provider_for_screen(Gdk.Screen.get_default(), style, Gtk.STYLE_PROVIDER_PRIORITY_APPLICATION)
        self.calibration = None
        self.loading = None
        self.ticks = 0
        self.add_state()
        self.add_switches()
        self.add_bars()
        self.add_values()
        self.box.show_all()
        self.tick()
        GLib.timeout_add(PERIOD_MS, self.tick)

    def add_state(self):
        self.colour = Gtk.EventBox()
        add_class(self.colour, "state")
        inside = Gtk.Box(orientation=Gtk.Orientation.VERTICAL, margin=10)
        self.state, self.why = label(style="title"), label()
        self.why.set_line_wrap(True)
        inside.add(self.state)
        inside.add(self.why)
        self.colour.add(inside)
        self.box.add(self.colour)

    def add_switches(self):
        row = Gtk.Box(spacing=8, homogeneous=True)
        self.switches = {}
        for name, title in (("enable", "Enable"), ("dry-run", "Dry run")):
            button = Gtk.ToggleButton(label=title)
            button.set_size_request(-1, 44)
            button.connect("toggled", self.on_switch, name)
            self.switches[name] = button
            row.add(button)
        self.load, self.calibrate = Gtk.Button(label="Load a file…"), Gtk.Button(label="Calibrate…")
        self.load.connect("clicked", self.on_load)
        self.calibrate.connect("clicked", self.on_calibrate)
        self.calibrate.set_no_show_all(True)
        self.calibrate.set_visible(self.configuration.can_calibrate())
        row.add(self.load)
        row.add(self.calibrate)
        self.box.add(row)

    def add_bars(self):
        grid = Gtk.Grid(column_spacing=10, row_spacing=6)
        grid.attach(label("correction of each axis, between its bounds", "dim"), 1, 0, 1, 1)
        self.bars = {}
        joint = 0
        while pin("joint.%d.pos-in" % joint) is not None:
            letter = self.configuration.letter(joint)
            if letter != "-":
                row = len(self.bars) + 1
                bar, number, bound = Bar(True), label(style="number", right=True), label(style="number", right=True)
                for column, widget in enumerate((label(letter or str(joint), "axis"), bar, number, bound)):
                    grid.attach(widget, column, row, 1, 1)
                number.set_width_chars(8)
                bound.set_width_chars(11)
                self.bars[joint] = (bar, number, bound)
            joint += 1
        row = len(self.bars) + 1
        self.factor, self.factor_text = Bar(False), label(style="number", right=True)
        grid.attach(label("fade factor", "dim"), 1, row, 1, 1)
        grid.attach(self.factor, 1, row + 1, 1, 1)
        grid.attach(self.factor_text, 2, row + 1, 1, 1)
        self.box.add(grid)

    def add_values(self):
        grid = Gtk.Grid(column_spacing=16, row_spacing=4)
        names = ["tool-length"] + ["%s-%d" % (kind, n) for kind in ("temperature", "weight") for n in range(16)]
        self.values = {}
        for name in [name for name in names if pin(name) is not None] + ["file", "calibration"]:
            title = {"file": "Compensation", "calibration": "Last calibration"}.get(name)
            shown = label()
            shown.set_line_wrap(True)
            grid.attach(label(title or name.replace("-", " ").capitalize(), "dim"), 0, len(self.values), 1, 1)
            grid.attach(shown, 1, len(self.values), 1, 1)
            self.values[name] = shown
        self.box.add(grid)

    def tick(self):
        """Shows the pins; always true, so that it is called again."""
        state = pin("state")
        is_there = state is not None
        for widget in list(self.switches.values()) + [self.load, self.calibrate]:
            widget.set_sensitive(is_there)
        if not is_there:
            self.show_state("wrong", "Not loaded", "the component trueaxis is not loaded: HALFILE = trueaxis.hal below [HAL]")
            return True
        self.show_pins(state)
        if self.loading is not None:
            self.loading = self.loading if next(self.loading, False) else None
        self.load.set_sensitive(self.loading is None and self.configuration.file is not None)
        self.calibrate.set_sensitive(self.calibration is None)
        if self.ticks % 20 == 0:
            self.show_calibration()
        self.ticks += 1
        return True

    def show_state(self, colour, title, why):
        for name in set(COLOURS):
            (add_class if name == colour else remove_class)(self.colour, name)
        self.state.set_text(title)
        self.why.set_text(why)
        self.why.set_visible(bool(why))

    def show_pins(self, state):
        fault = FAULTS[pin("fault-code")] if pin("fault-code") < len(FAULTS) else "unknown"
        joint = pin("waiting-for")
        letter = self.configuration.letter(joint) if joint >= 0 else ""
        words = STATES[state].format("%d%s" % (joint, " (%s)" % letter if letter else ""))
        title = "Corrections are ON" if state == 0 else "Corrections are OFF"
        why = [] if state in (0, 5) else [words]
        if state == 6:
            title, why = "Corrections are fading in", []
        elif pin("active") and state != 0:
            title = "Corrections are fading out"
        if pin("fault"):
            why.append("fault: " + fault)
        if pin("fading"):
            why.append("fading over to another file")
        if pin("saturated"):
            why.append("a correction is limited to the largest of its axis")
        if pin("beyond-range"):
            why.append("a temperature is outside of the range that was measured")
        self.show_state("wrong" if pin("fault") else COLOURS[state], title, "; ".join(why))
        for name, button in self.switches.items():
            button.handler_block_by_func(self.on_switch)
            button.set_active(bool(pin(name)))
            (add_class if pin(name) else remove_class)(button, "on")
            button.handler_unblock_by_func(self.on_switch)
            button.set_sensitive(not is_driven(name))
            button.set_tooltip_text("a signal of the machine drives this switch" if is_driven(name) else None)
        for joint, widgets in self.bars.items():
            self.show_bar(joint, *widgets)
        self.factor.show_value(pin("factor"))
        self.factor_text.set_text("%.3f" % pin("factor"))
        self.show_values()

    def show_bar(self, joint, bar, number, bound):
        correction, computed, used = (pin("joint.%d.%s" % (joint, name)) for name in ("correction", "computed", "bound-used"))
        # The bound is not a pin: it follows from a correction and its fraction of it.
        largest = abs(computed) / used if used > 0 else None
        bar.show_value(correction / largest if largest else 0.0, math.copysign(used, computed), used >= 1)
        number.set_text("%+.*f" % self.shown(joint, correction))
        digits, value = self.shown(joint, largest or 0)
        bound.set_text("± %.*f %s" % (digits, value, "°" if digits == 4 else "µm") if largest else "")

    def shown(self, joint, value):
        """Digits and value of a correction in µm or degrees; never -0."""
        if self.configuration.letter(joint) in ("A", "B", "C"):
            return 4, round(value, 4) + 0.0
        return 1, round(value / self.configuration.mm * 1e3, 1) + 0.0

    def show_values(self):
        for name, shown in self.values.items():
            if name == "file":
                file = os.path.basename(self.configuration.file or "")
                shown.set_text("%s, %08x" % (file, pin("checksum")) if pin("checksum") else "none")
            elif name != "calibration":
                unit = {"tool": " mm" if self.configuration.mm == 1 else " in", "temp": " °C"}.get(name[:4], "")
                missing = "as in the file" if name.startswith("weight") else "not connected"
                shown.set_text(missing if math.isnan(pin(name)) else "%.4g%s" % (pin(name), unit))

    def show_calibration(self):
        last = self.configuration.last_calibration()
        if last is None:
            text = "none in %s" % self.configuration.folder
        else:
            folder, when, found = last
            unseen = found.get("unseen", [])
            text = "%s: tip %.1f → %.1f µm rms, %s%.1f predicted, ± %.1f µm (95 %%)%s%s" % (
                time.strftime("%Y-%m-%d %H:%M", when),
                found["before"]["rms_um"],
                found["after"]["rms_um"],
                "" if unseen else "at most ",
                found["expected_um"],
                found["coverage_um"],
                "; not measured: %s" % ", ".join(unseen) if unseen else "",
                "" if found["is_kept"] else "; not kept",
            )
            self.values["calibration"].set_tooltip_text(folder)
        self.values["calibration"].set_text(text)

    def on_switch(self, button, name):
        set_pin(name, int(button.get_active()))

    def window(self):
        window = self.box.get_toplevel()
        return window if isinstance(window, Gtk.Window) else None

    def ask(self, title, text, answer, entry=None):
        """Whether the operator agrees; with what is written in a line of text, if there is one."""
        dialog = Gtk.MessageDialog(transient_for=self.window(), modal=True, text=title, secondary_text=text)
        dialog.add_buttons("Cancel", Gtk.ResponseType.CANCEL, answer, Gtk.ResponseType.OK)
        line = Gtk.Entry(text=entry or "", width_chars=80)
        if entry is not None:
            dialog.get_message_area().add(line)
            line.show()
        is_yes = dialog.run() == Gtk.ResponseType.OK
        written = line.get_text()
        dialog.destroy()
        return (is_yes, written) if entry is not None else is_yes

    def on_load(self, _):
        chooser = Gtk.FileChooserDialog(title="Load a compensation", transient_for=self.window(), modal=True)
        chooser.add_buttons("Cancel", Gtk.ResponseType.CANCEL, "Load", Gtk.ResponseType.OK)
        only = Gtk.FileFilter()
        only.set_name("compensations (*.trax)")
        only.add_pattern("*.trax")
        chooser.add_filter(only)
        chooser.set_current_folder(self.configuration.folder)
        chosen = chooser.get_filename() if chooser.run() == Gtk.ResponseType.OK else None
        chooser.destroy()
        if chosen and os.path.realpath(chosen) == os.path.realpath(self.configuration.file):
            self.loading = self.reload(None)
        elif chosen and self.ask(
            "Replace the compensation?",
            "%s takes the place of %s, which is kept as %s.old. If the corrections are on, they fade over."
            % ((chosen,) + (os.path.basename(self.configuration.file),) * 2),
            "Load",
        ):
            self.loading = self.replaced(chosen)

    def replaced(self, chosen):
        """Loads a file in place of the present one, step by step; the present one returns if it is not accepted."""
        place = self.configuration.file
        try:
            with open(chosen, "rb") as source:
                new = source.read()
            old = None
            if os.path.exists(place):
                with open(place, "rb") as source:
                    old = source.read()
                put(place + ".old", old)
            put(place, new)
        except OSError as error:
            self.say("The file cannot be replaced", str(error))
            return
        yield from self.reload(old)

    def reload(self, old):
        set_pin("reload", 0)
        yield True
        yield True
        set_pin("reload", 1)
        yield True
        yield True
        for _ in range(LONGEST):
            if not pin("loading"):
                break
            yield True
        yield True
        set_pin("reload", 0)
        code = pin("load-fault")
        if not code:
            return
        if old is not None:
            put(self.configuration.file, old)
            yield from self.reload(None)
        GLib.idle_add(self.say, "The file is not accepted", FAULTS[code] + ("; the previous one is back" if old else ""))

    def say(self, title, text):
        dialog = Gtk.MessageDialog(transient_for=self.window(), modal=True, text=title, secondary_text=text)
        dialog.add_button("Close", Gtk.ResponseType.CLOSE)
        dialog.connect("response", lambda *_: dialog.destroy())
        dialog.show()

    def on_calibrate(self, _):
        is_yes, command = self.ask(
            "Calibrate the machine?",
            "The stylus must be in the spindle and clear of everything. The command asks again before each kind of motion. "
            "[TRUEAXIS] CALIBRATE in the INI file is its default.",
            "Start",
            self.configuration.calibrate(),
        )
        if is_yes:
            self.calibration = Conversation(command, self.configuration.folder, self.on_calibrated)

    def on_calibrated(self):
        self.calibration = None
        self.show_calibration()


def put(path, contents):
    """Replaces a file at once."""
    with open(path + ".new", "wb") as new:
        new.write(contents)
        new.flush()
        os.fsync(new.fileno())
    os.replace(path + ".new", path)


class Conversation:
    """A window with the output of a command, and buttons for its questions."""

    def __init__(self, command, folder, at_end):
        self.at_end = at_end
        self.window = Gtk.Window(title="trueaxis: calibration", default_width=900, default_height=520)
        self.text = Gtk.TextView(editable=False, monospace=True, left_margin=8, top_margin=8)
        scrolled = Gtk.ScrolledWindow(vexpand=True)
        scrolled.add(self.text)
        self.question = label()
        self.question.set_line_wrap(True)
        self.buttons = {}
        row = Gtk.Box(spacing=8)
        row.pack_start(self.question, True, True, 0)
        for name, action in (("Yes", self.yes), ("No", self.no), ("Stop", self.stop), ("Close", self.close)):
            self.buttons[name] = Gtk.Button(label=name)
            self.buttons[name].set_size_request(90, 40)
            self.buttons[name].connect("clicked", lambda _, act=action: act())
            row.add(self.buttons[name])
        box = Gtk.Box(orientation=Gtk.Orientation.VERTICAL, spacing=8, margin=8)
        box.add(scrolled)
        box.add(row)
        self.window.add(box)
        self.window.connect("delete-event", lambda *_: self.process is not None)
        self.process = None
        self.window.show_all()
        self.show("$ %s\n" % command)
        try:
            self.process = subprocess.Popen(
                shlex.split(command), cwd=folder, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
            )
        except (OSError, ValueError) as error:
            self.ended("it does not start: %s" % error)
            return
        self.output = self.process.stdout.fileno()
        self.rest = b""
        GLib.io_add_watch(self.output, GLib.IO_IN | GLib.IO_HUP, self.on_output)
        self.ask("")

    def show(self, text):
        buffer = self.text.get_buffer()
        buffer.insert(buffer.get_end_iter(), text)
        self.text.scroll_to_mark(buffer.create_mark(None, buffer.get_end_iter(), False), 0, False, 0, 1)

    def ask(self, question):
        self.question.set_text(question)
        for name, is_on in (("Yes", question), ("No", question), ("Stop", True), ("Close", False)):
            self.buttons[name].set_sensitive(bool(is_on))

    def on_output(self, *_):
        read = os.read(self.output, 65536)
        if not read:
            self.ended("it ended with code %d" % self.process.wait())
            return False
        # A letter may be cut in two.
        self.rest += read
        try:
            text, self.rest = self.rest.decode(), b""
        except UnicodeDecodeError as error:
            text, self.rest = self.rest[: error.start].decode(), self.rest[error.start :]
        self.show(text)
        if text.endswith("[y/N] "):
            self.ask(text.splitlines()[-1][: -len("[y/N] ")])
        return True

    def answer(self, word):
        self.show(word + "\n")
        self.ask("")
        try:
            self.process.stdin.write(word.encode() + b"\n")
            self.process.stdin.flush()
        except BrokenPipeError:
            pass

    def yes(self):
        self.answer("y")

    def no(self):
        self.answer("n")

    def stop(self):
        self.process.send_signal(signal.SIGTERM)

    def close(self):
        self.window.destroy()

    def ended(self, how):
        self.process = None
        self.show("\n%s\n" % how)
        self.ask("")
        self.buttons["Stop"].set_sensitive(False)
        self.buttons["Close"].set_sensitive(True)
        self.at_end()

    def end(self):
        """LinuxCNC ends: the command stops the machine, and puts back what it changed."""
        if self.process is not None:
            self.process.send_signal(signal.SIGTERM)


panels = []


def on_unix_signal(*_):
    """The screen ends."""
    for panel in panels:
        if panel.calibration is not None:
            panel.calibration.end()
    Gtk.main_quit()


def get_handlers(component, builder, options):
    """Called by GladeVCP."""
    panels.append(Panel(builder))
    return [{"on_unix_signal": on_unix_signal}]
