"""Readings of instruments on a machine with errors, from rigid-body transformations alone.

    python3 observations.py machine.toml errors.toml observations.csv

Reads the files that `trueaxis` reads, shares no code with it, and prints for every row its line, its kind and the
residual of each coordinate: the file's reading less that of the machine, in µm, or µrad for angles. Set-ups are where
the lines with # put them. Needs Python 3.11 and no packages.
"""

import csv
import math
import sys
import tomllib

LINEAR, ROTARY = "XYZUVW", "ABC"


def product(a, b):
    return [[sum(a[i][k] * b[k][j] for k in range(len(b))) for j in range(len(b[0]))] for i in range(len(a))]


def transposed(a):
    return [list(column) for column in zip(*a)]


def identity(n):
    return [[1.0 if i == j else 0.0 for j in range(n)] for i in range(n)]


def rotation(axis, angle):
    """About x, y or z (0, 1, 2)."""
    c, s = math.cos(angle), math.sin(angle)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    r = identity(3)
    r[i][i], r[i][j], r[j][i], r[j][j] = c, -s, s, c
    return r


def transformation(r, t):
    return [r[i] + [t[i]] for i in range(3)] + [[0.0, 0.0, 0.0, 1.0]]


def pose(x, y, z, a, b, c):
    r = product(product(rotation(0, a), rotation(1, b)), rotation(2, c))
    return transformation(r, [x, y, z])


def inverse(h):
    r = transposed([row[:3] for row in h[:3]])
    t = [-sum(r[i][k] * h[k][3] for k in range(3)) for i in range(3)]
    return transformation(r, t)


def turn_of(h):
    return [row[:3] for row in h[:3]]


def moved(h, point):
    return [sum(h[i][k] * point[k] for k in range(3)) + h[i][3] for i in range(3)]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def less(a, b):
    return [x - y for x, y in zip(a, b)]


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def unit(a):
    length = math.sqrt(dot(a, a))
    return [x / length for x in a]


def twist(r):
    return [(r[2][1] - r[1][2]) / 2, (r[0][2] - r[2][0]) / 2, (r[1][0] - r[0][1]) / 2]


def frame(entry):
    """A frame given in the foundation frame: origin_mm, orientation_deg."""
    angles = [math.radians(v) for v in entry.get("orientation_deg", [0.0] * 3)]
    return pose(*entry.get("origin_mm", [0.0] * 3), *angles)


class Machine:
    def __init__(self, machine, errors):
        self.axes = machine["axis"]
        self.tip = machine["tool"]["tip_mm"]
        self.spindle = machine.get("spindle", {})
        self.tool_axis = "xyz".index(self.spindle.get("axis", "z"))
        self.workpiece = machine.get("workpiece", {})
        self.located = {}
        self.terms = {}
        for name, value in errors.items():
            component = "XYZABC".index(name[1])
            if name[2] == "0":
                self.located.setdefault(name[3], [0.0] * 6)[component] += value
                continue
            axis, rest = name[2], name[3:]
            if rest == "b":
                kind = (lambda q, sign: sign)
            elif rest[0] in "cs":
                k, of = int(rest[1:]), math.cos if rest[0] == "c" else math.sin
                kind = (lambda q, sign, k=k, of=of: of(k * q))
            else:
                kind = (lambda q, sign, k=int(rest): q**k)
            self.terms.setdefault(axis, []).append((component, value, kind))

    def chain(self, branch, q, signs, last, with_errors):
        """From the foundation to a frame at the end of a branch."""
        h, before = identity(4), identity(4)
        for axis in self.axes:
            if axis["branch"] != branch:
                continue
            name = axis["name"]
            own = frame(axis)
            h = product(h, product(inverse(before), own))
            before = own
            if with_errors:
                h = product(h, pose(*self.located.get(name, [0.0] * 6)))
            way = -q[name] if axis.get("reversed", False) else q[name]
            if name in LINEAR:
                step = [0.0] * 3
                step[LINEAR.index(name) % 3] = way
                h = product(h, transformation(identity(3), step))
            else:
                h = product(h, transformation(rotation(ROTARY.index(name), way), [0.0] * 3))
            if with_errors:
                error = [0.0] * 6
                for component, value, kind in self.terms.get(name, []):
                    error[component] += value * kind(q[name], signs[name])
                h = product(h, pose(*error))
        h = product(h, product(inverse(before), frame(last)))
        if with_errors and branch == "tool":
            h = product(h, pose(*self.located.get("S", [0.0] * 6)))
        return h

    def spindle_in_workpiece(self, q, signs, with_errors):
        workpiece = self.chain("workpiece", q, signs, self.workpiece, with_errors)
        tool = self.chain("tool", q, signs, self.spindle, with_errors)
        return product(inverse(workpiece), tool)

    def nominal(self, q):
        return self.spindle_in_workpiece(q, {}, False)

    def way(self, q, name):
        """Direction in which a positive command of a linear axis moves the tool against the workpiece."""
        ahead = dict(q)
        ahead[name] += 1.0
        return unit(less(moved(self.nominal(ahead), self.tip), moved(self.nominal(q), self.tip)))

    def about(self, q, name):
        """Axis about which a positive command of a rotary axis turns the tool against the workpiece."""
        ahead = dict(q)
        ahead[name] += 1.0
        change = product(turn_of(self.nominal(ahead)), transposed(turn_of(self.nominal(q))))
        return unit(twist(change))

    def ways(self, q):
        """Orthonormal directions of the first three linear axes in the order of their letters, as columns."""
        linear = [axis["name"] for axis in self.axes if axis["name"] in LINEAR][:3]
        linear.sort(key=lambda name: LINEAR.index(name) % 3)
        x, y = (self.way(q, name) for name in linear[:2])
        y = unit(less(y, [dot(x, y) * v for v in x]))
        return transposed([x, y, cross(x, y)])


def direction(machine, q, words):
    """Of a growing reading, as the axes move the tool against the workpiece."""
    who, first, *to = words.split()
    sign = 1.0 if who == "tool" else -1.0
    if first[0] == "-":
        sign = -sign
    if not to:
        of = machine.way if first[1] in LINEAR else machine.about
        return [sign * v for v in of(q, first[1])]
    second = to[-1]
    if second[0] == "-":
        sign = -sign
    normal = unit(cross(machine.way(q, first[1]), machine.way(q, second[1])))
    return [sign * v for v in normal]


def main(machine_file, errors_file, observations_file):
    with open(machine_file, "rb") as file:
        machine_entries = tomllib.load(file)
    with open(errors_file, "rb") as file:
        errors = tomllib.load(file)["parameters"]
    machine = Machine(machine_entries, errors)
    with open(observations_file, encoding="utf-8") as file:
        lines = file.read().splitlines()
    heading = [line[1:] for line in lines if line.startswith("#")]
    setups = tomllib.loads("\n".join(heading)).get("setup", {})
    tools = {entry["tool"]: entry["tool_mm"] for entry in setups.values() if "tool" in entry and "tool_mm" in entry}
    first = {}
    rows = csv.DictReader(lines[len(heading):])
    for line, row in enumerate(rows, len(heading) + 2):
        name, kind = row["setup"], row["kind"]
        entry = setups.get(name, {})
        q, signs = {}, {}
        for axis in machine.axes:
            letter = axis["name"]
            value = float(row[letter])
            q[letter] = math.radians(value) if letter in ROTARY else value
            signs[letter] = float(row.get(letter + "_dir") or 0.0)
        tip = tools.get(entry.get("tool")) or entry.get("tool_mm", machine.tip)
        spindle = rotation(machine.tool_axis, math.radians(float(row.get("S") or 0.0)))
        tip = [dot(r, tip) for r in spindle]
        nominal = machine.nominal(q)
        actual = machine.spindle_in_workpiece(q, signs, True)
        point, planned = moved(actual, tip), moved(nominal, tip)
        first.setdefault(name, planned)
        default = first[name] if kind in ("displacement", "surface") else [0.0] * 3
        place = entry.get("place_mm", default)
        turn = turn_of(frame({"orientation_deg": entry.get("orientation_deg", [0.0] * 3)}))
        away = less(point, place)
        if kind == "length":
            reads = [math.sqrt(dot(away, away)) - entry.get("dead_length_mm", 0.0)]
            read, scale = [float(row["length_mm"])], 1e3
        elif kind == "point":
            reads = [dot(column, away) for column in transposed(turn)]
            read, scale = [float(row[c]) for c in ("x_mm", "y_mm", "z_mm")], 1e3
        elif kind == "displacement":
            along = direction(machine, q, row["reads"])
            ways = machine.ways(q)
            aligned = product(product(ways, turn), transposed(ways))
            n = [dot(r, along) for r in aligned]
            reads = [dot(n, away) - dot(along, less(planned, first[name]))]
            read, scale = [float(row["displacement_um"]) * 1e-3], 1e3
        elif kind == "angle":
            excess = product(turn_of(actual), transposed(turn_of(nominal)))
            from_zero = product(excess, transposed(turn))
            reads = [dot(direction(machine, q, row["reads"]), twist(from_zero))]
            read, scale = [float(row["angle_urad"]) * 1e-6], 1e6
        elif kind == "surface":
            normal = unit([float(row["normal_" + c]) for c in "xyz"])
            in_part, meant = (
                [dot(column, less(p, place if k == 0 else first[name])) for column in transposed(turn)]
                for k, p in enumerate((point, planned))
            )
            reads = [dot(normal, less(in_part, meant))]
            read, scale = [float(row["deviation_um"]) * 1e-3], 1e3
        residuals = [(a - b) * scale for a, b in zip(read, reads)]
        print(line, kind, *(f"{value:.9e}" for value in residuals))


if __name__ == "__main__":
    main(*sys.argv[1:])
