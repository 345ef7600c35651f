"""Machines as chains of rigid bodies, for many positions at once: the poses of a machine with errors.

Reads the machine and error files that `trueaxis` reads and shares no code with it. Lengths are in mm, angles in rad.
Needs Python 3.11 and numpy.
"""

import csv
import tomllib

import numpy as np

LETTERS = "XYZABC"


def turn(axis, angles):
    """Rotations about x, y or z (0, 1, 2), one for each angle."""
    angles = np.atleast_1d(np.asarray(angles, float))
    i, j = (axis + 1) % 3, (axis + 2) % 3
    r = np.tile(np.eye(3), (len(angles), 1, 1))
    r[:, i, i] = r[:, j, j] = np.cos(angles)
    r[:, j, i] = np.sin(angles)
    r[:, i, j] = -r[:, j, i]
    return r


def pose(v):
    """Trans(x, y, z) · Rx(a) · Ry(b) · Rz(c) for each row [x y z a b c]."""
    v = np.atleast_2d(v)
    h = np.tile(np.eye(4), (len(v), 1, 1))
    h[:, :3, :3] = turn(0, v[:, 3]) @ turn(1, v[:, 4]) @ turn(2, v[:, 5])
    h[:, :3, 3] = v[:, :3]
    return h


def fixed(table):
    """The frame of an axis or of the spindle in the foundation frame."""
    return pose([*table.get("origin_mm", [0, 0, 0]), *np.radians(table.get("orientation_deg", [0, 0, 0]))])


class Machine:
    def __init__(self, path):
        with open(path, "rb") as file:
            described = tomllib.load(file)
        self.axes = described["axis"]
        self.names = [axis["name"] for axis in self.axes]
        self.spindle = fixed(described.get("spindle", {}))
        self.tip = np.array(described["tool"]["tip_mm"], float)

    def q(self, **given):
        """Positions of all axes (mm, deg): those given, and zero."""
        count = max([len(np.atleast_1d(g)) for g in given.values()], default=1)
        return {n: np.broadcast_to(np.asarray(given.get(n, 0.0), float), (count,)) for n in self.names}

    def branch(self, which, q, errors, came):
        count = len(q[self.names[0]])
        h, frame = np.tile(np.eye(4), (count, 1, 1)), np.eye(4)[None]
        for axis in (a for a in self.axes if a["branch"] == which):
            name, own = axis["name"], fixed(axis)
            k = LETTERS.index(name)
            at = q[name] if k < 3 else np.radians(q[name])
            before, moved, after = np.zeros(6), np.zeros((count, 6)), np.zeros((count, 6))
            moved[:, k] = at
            for parameter, value in errors.items():
                row = LETTERS.index(parameter[1])
                if parameter[2:] == "0" + name:
                    before[row] += value
                elif parameter[2] == name and parameter[3] == "b":
                    after[:, row] += value * came.get(name, 0.0)
                elif parameter[2] == name:
                    after[:, row] += value * at ** int(parameter[3])
            h = h @ (np.linalg.inv(frame) @ own) @ pose(before) @ pose(moved) @ pose(after)
            frame = own
        return h, frame

    def seen(self, q, errors, came=None):
        """The tool in the frame of the workpiece."""
        came = came or {}
        work, frame = self.branch("workpiece", q, errors, came)
        tool, last = self.branch("tool", q, errors, came)
        spindle = np.zeros(6)
        for parameter, value in errors.items():
            if parameter[2:] == "0S":
                spindle[LETTERS.index(parameter[1])] += value
        tip = pose([*self.tip, 0, 0, 0])
        tool = tool @ (np.linalg.inv(last) @ self.spindle) @ pose(spindle) @ tip
        return np.linalg.inv(work @ np.linalg.inv(frame)) @ tool

    def error(self, q, errors, came=None, moved=None):
        """The volumetric error [x y z a b c] in the frame of the tool: of a machine that goes to q + moved."""
        to = q if moved is None else {n: q[n] + moved.get(n, 0.0) for n in q}
        h = np.linalg.inv(self.seen(q, {})) @ self.seen(to, errors, came)
        r = h[:, :3, :3]
        turned = [r[:, 2, 1] - r[:, 1, 2], r[:, 0, 2] - r[:, 2, 0], r[:, 1, 0] - r[:, 0, 1]]
        return np.column_stack([h[:, :3, 3], np.column_stack(turned) / 2])

    def onto(self, point, **rotary):
        """The positions of all axes that bring the tip of the perfect machine to a point of the workpiece."""
        q = self.q(**rotary)
        at = self.seen(q, {})[:, :3, 3]
        # Linear axes move the tip in proportion.
        steps = [self.seen({**q, n: q[n] + 1.0}, {})[:, :3, 3] - at for n in "XYZ"]
        found = np.linalg.solve(np.stack(steps, axis=2), (np.asarray(point) - at)[..., None])[..., 0]
        return {**q, **{n: q[n] + found[:, k] for k, n in enumerate("XYZ")}}


def parameters(path):
    with open(path, "rb") as file:
        return tomllib.load(file)["parameters"]


def rows(path, *columns):
    with open(path, encoding="utf-8") as file:
        return [[float(row[c]) for c in columns] for row in csv.DictReader(file)]
