# SPDX-License-Identifier: MIT
"""For tests only: writes what the panel shows to /tmp/shown.json, and where its buttons are; answers dialogs.

Dialogs have no keyboard under a screen without a window manager. The next line of /tmp/answers is the name of a file to
choose, or `OK` or `CANCEL`.
"""
import json
import os

from gi.repository import GLib, Gtk

import trueaxis_panel

# The last one.
conversations = []


def centre(widget):
    """Place on the screen."""
    top = widget.get_toplevel()
    window = top.get_window()
    if window is None or widget.get_allocated_width() < 20:
        return None
    _, x, y = window.get_origin()
    at = widget.translate_coordinates(top, widget.get_allocated_width() // 2, widget.get_allocated_height() // 2)
    return [x + at[0], y + at[1]]


def written(text):
    """What is in a view of text."""
    buffer = text.get_buffer()
    return buffer.get_text(buffer.get_start_iter(), buffer.get_end_iter(), True)


def dialog():
    shown = [w for w in Gtk.Window.list_toplevels() if isinstance(w, Gtk.Dialog) and w.get_visible()]
    return shown[-1] if shown else None


def answer(shown):
    if not os.path.exists("/tmp/answers"):
        return
    with open("/tmp/answers") as lines:
        word = lines.read().strip()
    if isinstance(shown, Gtk.FileChooserDialog) and word.startswith("/"):
        if shown.get_filename() != word:
            shown.set_filename(word)
            return
        word = "OK"
    os.remove("/tmp/answers")
    shown.response(getattr(Gtk.ResponseType, word))


def tick(panel):
    buttons = dict(panel.switches, load=panel.load, calibrate=panel.calibrate)
    shown = {
        "state": panel.state.get_text(),
        "why": panel.why.get_text(),
        "colour": [name for name in set(trueaxis_panel.COLOURS) if panel.colour.get_style_context().has_class(name)],
        "on": {name: button.get_active() for name, button in panel.switches.items()},
        "bars": {
            panel.configuration.letter(joint): [bar.value, bar.mark, number.get_text(), bound.get_text()]
            for joint, (bar, number, bound) in panel.bars.items()
        },
        "factor": [panel.factor.value, panel.factor_text.get_text()],
        "values": {name: value.get_text() for name, value in panel.values.items()},
        "dialog": None,
        "output": None,
    }
    if panel.calibration is not None:
        shown["output"] = written(panel.calibration.text)
        conversations[:] = [panel.calibration]
    for conversation in conversations:
        if conversation.window.get_visible():
            buttons.update(conversation.buttons)
    shown["buttons"] = {name: centre(button) if button.get_sensitive() else None for name, button in buttons.items()}
    open_dialog = dialog()
    if open_dialog is not None:
        shown["dialog"] = open_dialog.get_title() or open_dialog.get_property("text")
        if hasattr(open_dialog.props, "secondary_text"):
            shown["dialog"] += ": " + (open_dialog.props.secondary_text or "")
        answer(open_dialog)
    with open("/tmp/shown.new", "w") as out:
        json.dump(shown, out)
    os.replace("/tmp/shown.new", "/tmp/shown.json")
    return True


def get_handlers(component, builder, options):
    GLib.timeout_add(100, tick, trueaxis_panel.panels[0])
    return [{}]
