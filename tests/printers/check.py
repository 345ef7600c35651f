"""Loads what `trueaxis export` writes with the modules of a printer's firmware, and moves an exact printer with them.

Called by `cargo xtask printers`: check.py FOLDER TRUEAXIS NAME, where FOLDER has the package `klippy` of Klipper or Kalico.
Nothing of the firmware is repeated here: its own skew_correction, bed_mesh and axis_twist_compensation compute, and
`trueaxis pose` says where the nozzle of a printer with errors is. Python's standard library is enough.
"""

import configparser
import csv
import importlib
import itertools
import math
import pathlib
import random
import re
import subprocess
import sys
import tempfile
import types

FIRMWARE, TRUEAXIS, NAME = sys.argv[1:4]
TRAVEL = [(0.0, 235.0), (0.0, 235.0), (0.0, 250.0)]
# Diagonals and sides of three planes as somebody measures them, and a bridge that bends and twists.
LENGTHS = {"xy": "141.32,141.51,100", "xz": "141.55,141.30,100", "yz": "141.40,141.44,100"}
BENT = "EZX2 = 4e-6\n"
TWISTED = "[tabulated.EAX]\nat = [0.0, 60.0, 120.0, 180.0, 235.0]\nvalue = [-300.0, 0.0, 500.0, 300.0, -400.0]\nunit = \"urad\"\n"
PROBE = (-28.0, -13.0)


def firmware():
    """Its modules, without the parts of the package that need a running printer."""
    root = pathlib.Path(FIRMWARE)
    sys.path.insert(0, str(root))
    sys.path.insert(1, str(root / "klippy"))
    for name in ["greenlet", "serial", "can", "cffi", "jinja2", "msgspec"]:
        try:
            importlib.import_module(name)
        except ImportError:
            sys.modules[name] = types.ModuleType(name)
    extras = types.ModuleType("extras")
    extras.__path__ = [str(root / "klippy/extras")]
    sys.modules["extras"] = extras
    # Siblings that only drive a probe.
    for name in ["probe", "manual_probe"]:
        sys.modules[f"extras.{name}"] = types.ModuleType(f"extras.{name}")
        setattr(extras, name, sys.modules[f"extras.{name}"])
    options = types.ModuleType("extras.danger_options")
    options.get_danger_options = lambda: types.SimpleNamespace(log_bed_mesh_at_startup=False)
    sys.modules["extras.danger_options"] = options
    return [importlib.import_module(f"extras.{name}") for name in ["skew_correction", "bed_mesh", "axis_twist_compensation"]]


class Command:
    """A line of G-code, as the dispatcher hands it to a command."""

    error = Exception

    def __init__(self, words):
        self.words = words

    def get(self, name, default=None, **_):
        return self.words.get(name, default)

    def get_int(self, name, default=None, **_):
        return int(self.words.get(name, default))

    def get_float(self, name, default=None, **_):
        return float(self.words.get(name, default))

    def get_commandline(self):
        return str(self.words)


class Gcode:
    """Commands by their names, and the chain of transformations of moves."""

    def __init__(self):
        self.commands = {}
        self.transform = None

    def register_command(self, name, run, **_):
        self.commands[name] = run

    def set_move_transform(self, transform, force=False):
        before, self.transform = self.transform, transform
        return before

    def reset_last_position(self):
        pass

    def respond_info(self, *_, **__):
        pass

    def run(self, line):
        name, *words = line.split()
        self.commands[name](Command(dict(word.split("=", 1) for word in words)))


class Printer:
    def __init__(self):
        self.gcode = Gcode()
        self.handlers = {}

    def lookup_object(self, name, default=None):
        return self.gcode if name in ("gcode", "gcode_move") else default

    def register_event_handler(self, event, handler):
        self.handlers.setdefault(event, []).append(handler)

    def add_object(self, *_):
        pass


class Config:
    """A section of printer.cfg, read as the firmware reads it: its own parser of lists, its own types."""

    error = configparser.Error

    def __init__(self, printer, file, section):
        self.printer, self.file, self.section = printer, file, section

    def get_printer(self):
        return self.printer

    def get_name(self):
        return self.section

    def get_prefix_sections(self, prefix):
        return [Config(self.printer, self.file, s) for s in self.file.sections() if s.startswith(prefix)]

    def _get(self, option, default, of):
        if not self.file.has_option(self.section, option):
            if default == []:
                return ()
            return default
        return of(self.file.get(self.section, option))

    def get(self, option, default=None, **_):
        return self._get(option, default, str)

    def getint(self, option, default=None, **_):
        return self._get(option, default, int)

    def getfloat(self, option, default=None, **_):
        return self._get(option, default, float)

    def getlists(self, option, default=None, seps=(",",), parser=str, **_):
        def split(text, k):
            parts = [p.strip() for p in text.split(seps[k])]
            return tuple(split(p, k - 1) for p in parts if p) if k else tuple(parser(p) for p in parts)

        return self._get(option, default, lambda text: split(text.strip(), len(seps) - 1))


def config(printer, text, section):
    file = configparser.RawConfigParser(strict=False, inline_comment_prefixes=(";", "#"))
    file.read_string(text)
    return Config(printer, file, section)


def trueaxis(*words, codes=(0,)):
    done = subprocess.run([TRUEAXIS, *map(str, words)], capture_output=True, text=True)
    if done.returncode not in codes:
        sys.exit(f"trueaxis {' '.join(map(str, words))}\n{done.stderr}{done.stdout}")
    return done.stdout


def poses(folder, machine, errors, commands):
    """Where the nozzle is at commands, without and with errors."""
    path, out = folder / "at.csv", folder / "poses.csv"
    with open(path, "w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow("XYZ")
        writer.writerows([f"{v:.9f}" for v in c] for c in commands)
    trueaxis("pose", machine, errors, "--positions", path, "-o", out)
    with open(out, newline="") as file:
        rows = list(csv.DictReader(file))
    actual = [k for k in rows[0] if k.startswith("actual")] or list(rows[0])[-6:]
    return [[float(r[k]) for k in "xyz"] for r in rows], [[float(r[k]) for k in actual[:3]] for r in rows]


class Bed:
    """The end of the chain: the mesh of the firmware on top of the axes, as BedMesh.move adds it."""

    def __init__(self, mesh):
        self.mesh, self.at = mesh, None

    def get_position(self):
        return self.at

    def move(self, newpos, _):
        z = self.mesh.calc_z(newpos[0], newpos[1])
        self.at = [newpos[0], newpos[1], newpos[2] + z]


def skew_and_mesh(folder, skew_correction, bed_mesh, machine, errors):
    trax, lines, mesh = folder / "p.trax", folder / "skew.cfg", folder / "mesh.cfg"
    trueaxis("compile", machine, errors, "-o", trax, "--random", 2000)
    trueaxis("export", "klipper", trax, "-o", lines, "--height-map", mesh, "--points", "41,21")
    printer = Printer()
    text = mesh.read_text()
    holder = types.SimpleNamespace(mesh=None)
    holder.set_mesh = lambda z_mesh: setattr(holder, "mesh", z_mesh)
    profiles = bed_mesh.ProfileManager(config(printer, text, "bed_mesh"), holder)
    profiles.load_profile("trueaxis")
    printer.gcode.transform = Bed(holder.mesh)
    axes = printer.gcode.transform
    skew = skew_correction.PrinterSkew(config(printer, "[skew_correction]\n", "skew_correction"))
    for handler in printer.handlers["klippy:connect"]:
        handler()
    printer.gcode.run(lines.read_text().strip())
    draw = random.Random(7)
    # 2 mm from the ends: a mesh holds its end value, and skewed commands would leave it.
    commands = [[draw.uniform(a + 2, b - 2) for a, b in TRAVEL] for _ in range(400)]
    corrected = []
    for command in commands:
        printer.gcode.transform.move([*command, 0.0], 50.0)
        corrected.append(axes.at)
    nominal, before = poses(folder, machine, errors, commands)
    _, after = poses(folder, machine, errors, corrected)

    def worst(found):
        # Between all pairs of points: no turn or shift of the work counts.
        pairs = itertools.combinations(range(len(nominal)), 2)
        return 1e3 * max(abs(math.dist(found[i], found[j]) - math.dist(nominal[i], nominal[j])) for i, j in pairs)

    return worst(before), worst(after)


def twist(folder, module, machine, errors):
    """Readings of a probe beside the nozzle, before and with the table; the second one as Klipper looks it up today."""
    found = {}
    text = machine.read_text()
    probe_machine = folder / "probe.toml"
    tip = f"tip_mm = [{PROBE[0]}, {PROBE[1]}, -40.0]"
    probe_machine.write_text(re.sub(r"tip_mm = .*", tip, text))
    low, high = 30.0, 200.0
    places = [(x, y) for x in [low + k * (high - low) / 40 for k in range(41)] for y in (30.0, 110.0, 200.0)]
    stood = [(x - PROBE[0], y - PROBE[1], 0.0) for x, y in places]
    inside = [k for k, s in enumerate(stood) if all(a <= v <= b for v, (a, b) in zip(s, TRAVEL))]
    places, stood = [places[k] for k in inside], [stood[k] for k in inside]
    nominal_p, actual_p = poses(folder, probe_machine, errors, stood)
    nominal_n, actual_n = poses(folder, machine, errors, [(x, y, 0.0) for x, y in places])
    # What the nozzle would read, minus what the probe reads.
    missing = [
        (ap[2] - np[2]) - (an[2] - nn[2])
        for np, ap, nn, an in zip(nominal_p, actual_p, nominal_n, actual_n)
    ]
    for lookup in ["nozzle", "bed"]:
        out = folder / "twist.cfg"
        trueaxis("export", "klipper-twist", machine, errors, f"--probe={PROBE[0]},{PROBE[1]}", "--lookup", lookup, "--points", 41, "--best-effort", "-o", out, codes=(0, 1))
        more = "calibrate_start_x = 20\ncalibrate_end_x = 200\ncalibrate_y = 100\n"
        compensation = module.AxisTwistCompensation(config(Printer(), out.read_text() + more, "axis_twist_compensation"))
        at = {"nozzle": stood, "bed": places}[lookup]
        # The value that the firmware adds at a position: which one it passes is what differs between versions.
        values = [compensation.get_z_compensation_value([x, y]) for x, y, *_ in at]
        left = [m - v for m, v in zip(missing, values)]
        found[lookup] = [500.0 * (max(e) - min(e)) for e in (missing, left)]
    return found


def main():
    skew_correction, bed_mesh, axis_twist = firmware()
    results = {}
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        machine, errors = folder / "machine.toml", folder / "errors.toml"
        lengths = [word for plane, value in LENGTHS.items() for word in (f"--{plane}", value)]
        trueaxis("skew", *lengths, "--travel", ",".join(f"{a:g}:{b:g}" for a, b in TRAVEL), "--machine", machine, "--errors", errors)
        text = errors.read_text().replace("[parameters]\n", "[parameters]\n" + BENT)
        errors.write_text(text)
        results["skew and mesh"] = skew_and_mesh(folder, skew_correction, bed_mesh, machine, errors)
        errors.write_text(f"machine = \"Printer\"\n{TWISTED}")
        if hasattr(axis_twist.AxisTwistCompensation, "_get_interpolated_z_compensation") and "zy_compensations" in pathlib.Path(axis_twist.__file__).read_text():
            for lookup, found in twist(folder, axis_twist, machine, errors).items():
                results[f"twist, looked up at the {lookup}'s position"] = found
        else:
            print(f"{NAME}: its axis_twist_compensation reads compensation_end_x from another key, and is left out")
    # µm. What firmware cannot do, of second order: an axis that leans by s is shorter by s²/2, 235 · 0.9e-6 of Y and
    # 250 · 1.6e-6 of Z; skew is computed before the mesh adds up to 220 µm to Z, which leans by 1.8e-3: 0.4. Together, with
    # tables within 0.05 and a mesh with points 6 mm apart (4e-6 · 6² / 4 = 0.04) at both ends: 1.2 at most. Twist: 13 mm of
    # bends of 10 µrad/mm that points 5 mm apart cut by 5/4: 0.16.
    most = {"skew and mesh": 1.2}
    bad = []
    for what, (before, after) in results.items():
        print(f"{NAME}: {what}: {before:.2f} µm before, {after:.3f} µm after")
        if after > most.get(what, 0.2):
            bad.append(what)
    if bad:
        sys.exit(f"{NAME}: too much is left of {', '.join(bad)}")


main()
