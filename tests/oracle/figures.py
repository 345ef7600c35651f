"""The most important figures of docs/evidence/reproduced.md, from rigid bodies alone.

    python3 figures.py examples

Prints a JSON object: a name for each figure, and what it is here. Shares no code with `trueaxis`. Needs Python 3.11 and
numpy.
"""

import json
import sys
from pathlib import Path

import numpy as np
from rigid import Machine, parameters, rows

EXAMPLES = Path(sys.argv[1])
KOLIBRI, HU40, HURON = (EXAMPLES / name for name in ("kolibri", "hu40", "huron-k2x8"))
# Table 5-5, setup S: mean volumetric error (µm) by each parameter.
EFFECTS = {"EB0A": 50.6, "EC0A": 88.8, "EY0C": 41.4, "EA0C": 6.38, "EB0C": 2.83,
           "EC0X": 4.96, "EA0Z": 33.8, "EB0Z": 10.8, "EYY1": 25.2, "EZZ1": 36.5}  # fmt: skip
ALONE = {"EB0A": 4e-4, "EC0A": 4e-4, "EY0C": 1e-2, "EA0C": 4e-4, "EB0C": 4e-4,
         "EC0X": 4e-4, "EA0Z": 4e-4, "EB0Z": 4e-4, "EYY1": 4e-5, "EZZ1": 4e-5}  # fmt: skip


def um(error):
    return 1e3 * error[:, :3]


def lengths(error):
    return np.linalg.norm(um(error), axis=1)


def rms(error):
    return np.sqrt((error**2).mean(axis=0))


def least_squares(of, start, rounds, step=1e-2):
    """Levenberg and Marquardt with central differences."""
    x, damping = np.array(start, float), 1e-3
    here = of(x)
    for _ in range(rounds):
        j = np.column_stack([(of(x + d) - of(x - d)) / (2 * step) for d in step * np.eye(len(x))])
        normal = j.T @ j
        move = np.linalg.solve(normal + damping * np.diag(np.diag(normal)), -j.T @ here)
        there = of(x + move)
        if there @ there < here @ here:
            x, here, damping = x + move, there, damping / 5
            if np.linalg.norm(move) < 1e-4:
                break
        else:
            damping *= 5
    return x, np.sqrt(np.mean(here**2))


def infer(machine, at, errors, table):
    names = list(table)
    printed = np.array(list(table.values()))

    def off(ball):
        q = machine.onto(ball, **at)
        back = np.linalg.inv(machine.seen(q, {}))
        return np.array([lengths((back @ machine.seen(q, {n: errors[n]}))[:, :3, 3]).mean() for n in names]) / printed - 1

    starts = [(40, 40, 60), (-40, 40, 60), (-40, -40, 60), (40, -40, 60)]
    near, _ = min((least_squares(off, start, 8) for start in starts), key=lambda found: found[1])
    return least_squares(off, near, 40)


def without_setup(machine, q, tip):
    """Displacements of the tip (tool frame) less what another place of ball and stylus explains best."""
    r = machine.seen(q, {})[:, :3, :3]
    # A ball that is off by b is seen as Rᵀ·b in the tool frame, a stylus as it is.
    a = np.concatenate([np.swapaxes(r, 1, 2), np.tile(np.eye(3), (len(r), 1, 1))], axis=2).reshape(-1, 6)
    found = np.linalg.lstsq(a, tip.reshape(-1), rcond=1e-9)[0]
    return tip - (a @ found).reshape(-1, 3)


def jacobian(machine, q):
    """Volumetric error by each axis (mm and rad per mm and rad), by central differences."""
    back = np.linalg.inv(machine.seen(q, {}))
    columns = []
    for name in machine.names:
        step = 1e-3 if name in "XYZ" else 1e-6
        given = step if name in "XYZ" else np.degrees(step)
        up, down = (back @ machine.seen({**q, name: q[name] + s * given}, {}) for s in (1, -1))
        d = (up - down) / (2 * step)
        columns.append(np.column_stack([d[:, :3, 3], d[:, 2, 1], d[:, 0, 2], d[:, 1, 0]]))
    return np.stack(columns, axis=2)


def correction(machine, q, errors):
    """Of each axis (mm, rad): least squares of all six rows, by the pseudo-inverse, to first order."""
    return -np.einsum("nij,nj->ni", np.linalg.pinv(jacobian(machine, q)), machine.error(q, errors))


def polynomials(machine, errors, zone, nodes=10):
    """25 cubic polynomials, least squares to the corrections on a grid of all axes: there they are those of the means
    along each axis. Corrections grow linearly with linear axes, of which two nodes are enough. Returns the correction
    (mm, deg) as a function of the axes."""
    names = machine.names
    counts = [2 if n in "XYZ" else nodes for n in names]
    along = [np.linspace(*zone[n], count) for n, count in zip(names, counts)]
    mesh = np.stack([m.ravel() for m in np.meshgrid(*along, indexing="ij")], axis=1)
    dq = correction(machine, {n: mesh[:, k] for k, n in enumerate(names)}, errors).reshape([*counts, len(names)])
    mean = dq.reshape(-1, len(names)).mean(axis=0)
    fits = []
    for k, count in enumerate(counts):
        others = tuple(i for i in range(len(names)) if i != k)
        fits.append(np.polynomial.polynomial.polyfit(np.linspace(-1, 1, count), dq.mean(axis=others) - mean, min(3, count - 1)))

    def of(q):
        total = np.tile(mean, (len(q[names[0]]), 1))
        for k, n in enumerate(names):
            low, high = zone[n]
            # Before the first and after the last point, tables hold.
            t = np.clip(2 * (q[n] - low) / (high - low) - 1, -1, 1)
            total += np.polynomial.polynomial.polyval(t, fits[k]).T
        return {n: total[:, k] if n in "XYZ" else np.degrees(total[:, k]) for k, n in enumerate(names)}

    return of


def triple(values):
    return " / ".join(f"{v:.3f}" for v in values)


def chapters_5_and_6(found):
    machine = Machine(KOLIBRI / "machine.toml")
    a, c = np.array(rows(KOLIBRI / "validation.csv", "A", "C")).T
    came = dict(zip("AC", np.array(rows(KOLIBRI / "validation.csv", "A_dir", "C_dir")).T))
    later = parameters(KOLIBRI / "errors-12-at-validation.toml")
    exchanged = {**EFFECTS, "EB0A": EFFECTS["EC0A"], "EC0A": EFFECTS["EB0A"]}
    ball, misfit = infer(machine, {"A": a, "C": c}, later, exchanged)
    found["place of the ball: x, y, z"] = triple(ball)
    found["… misfit of its ten effects"] = 100 * misfit
    found["… misfit with the rows as printed"] = 100 * infer(machine, {"A": a, "C": c}, later, EFFECTS)[1]
    q = machine.onto(ball, A=a, C=c)
    before = machine.error(q, later, came)
    found["mean: before"] = lengths(before).mean()
    found["RMS along X / Y / Z: before, raw"] = triple(rms(um(before)))
    found["RMS along X / Y / Z: before, set-up-free"] = triple(rms(without_setup(machine, q, um(before))))

    known = parameters(KOLIBRI / "errors-12.toml")
    balls = [(70, 20, 37.5), (-20, 75, 37.5), (-75, -15, 47.5), (15, -70, 47.5)]
    ca, cc = np.array(rows(KOLIBRI / "plan.csv", "A", "C")).T
    count = len(ca) // len(balls)
    probed = [machine.onto(b, A=ca[:count], C=cc[:count]) for b in balls]
    zone = {n: (min(p[n].min() for p in probed), max(p[n].max() for p in probed)) for n in machine.names}
    after = machine.error(q, later, came, polynomials(machine, known, zone)(q))
    found["… 12 errors"] = lengths(after).mean()

    # Chapter 6 has no tool, and another A in one pair (Table 6-3).
    machine.tip[:] = 0.0
    a = np.where((a == -5) & (c == -300), -50, a)
    q = machine.onto(ball, A=a, C=c)
    cases = [lengths(machine.error(q, {n: v})) for n, v in ALONE.items()]
    found["largest of the ten, before: mean at the probings"] = max(case.mean() for case in cases)
    found["… maximum"] = max(case.max() for case in cases)
    ten = {n: v for n, v in later.items() if not n.endswith("b")}
    error = machine.error(q, ten)
    found["mean: before, without tool"] = lengths(error).mean()
    free = np.linalg.norm(without_setup(machine, q, um(error)), axis=1)
    found["mean: before, set-up-free"], found["maximum: before, set-up-free"] = free.mean(), free.max()


def ball_bar(found, centre):
    """At the centre of the page: form, standard deviation, size and range of the readings."""
    machine = Machine(HU40 / "machine.toml")
    errors = parameters(HU40 / "errors-84.toml")
    up, around = np.radians(np.arange(1, 181)), np.radians(np.arange(0, 180, 36))
    # Meridians both ways, the equator once.
    path = 2 * [(np.cos(u) * np.cos(v), np.cos(u) * np.sin(v), np.sin(u)) for v in around for u in up]
    path += [(np.cos(v), np.sin(v), 0.0) for v in np.radians(np.arange(0, 181))]
    at = np.vstack([[0, 0, 0], 150.0 * np.array(path)]) + centre
    q = machine.q(**dict(zip("XYZ", at.T)))
    tips = [machine.seen(q, e)[:, :3, 3] for e in ({}, errors)]
    nominal, actual = (tip[1:] - tip[0] for tip in tips)
    direction = nominal / np.linalg.norm(nominal, axis=1)[:, None]
    read = 1e3 * (np.linalg.norm(actual, axis=1) - np.linalg.norm(nominal, axis=1))
    # Eqs. 15 to 17: the setup alone; then the sphere through what it leaves.
    free = read - direction @ np.linalg.lstsq(direction, read, rcond=None)[0]
    a = np.column_stack([direction, np.ones(len(read))])
    *moved, size = np.linalg.lstsq(a, free, rcond=None)[0]
    left = free - direction @ moved - size
    found["form, largest less smallest residual: before"] = np.ptp(left)
    found["form, standard deviation: before"] = left.std()
    found["size: before"] = size
    found["largest less smallest reading: before"] = np.ptp(free)


def grids(found):
    """Nodes along each axis to which one more adds less than 0.1 µm, with travels from zero."""
    machine = Machine(HU40 / "machine.toml")
    travel = {"X": 610.0, "Y": 560.0, "Z": 560.0}
    linear = [machine.names.index(n) for n in "XYZ"]
    random = np.random.default_rng(1)
    commands = {n: random.uniform(0, travel[n], 2000) for n in "XYZ"}
    q = machine.q(**commands)

    def left(errors, nodes):
        along = [np.linspace(0, travel[n], nodes) for n in "XYZ"]
        mesh = np.stack([m.ravel() for m in np.meshgrid(*along, indexing="ij")], axis=1)
        there = machine.q(**dict(zip("XYZ", mesh.T)))
        # Without rotary axes the linear ones alone null the translation; what is left of second order comes next.
        j, dq = jacobian(machine, there)[:, :3][:, :, linear], np.zeros((len(mesh), 3))
        for _ in range(3):
            off = machine.error(there, errors, None, dict(zip("XYZ", dq.T)))[:, :3, None]
            dq = dq - np.linalg.solve(j, off)[..., 0]
        dq = dq.reshape(nodes, nodes, nodes, 3)
        place, total = [], 0.0
        for n, points in zip("XYZ", along):
            first = np.clip(np.searchsorted(points, commands[n], side="right") - 1, 0, nodes - 2)
            place.append((first, (commands[n] - points[first]) / (points[1] - points[0])))
        for corner in np.ndindex(2, 2, 2):
            index = tuple(first + c for (first, _), c in zip(place, corner))
            weight = np.prod([part if c else 1 - part for (_, part), c in zip(place, corner)], axis=0)
            total = total + weight[:, None] * dq[index]
        return rms(machine.error(q, errors, None, dict(zip("XYZ", total.T)))[:, :3])

    for name, file in (("nodes, 13 errors", "errors-13.toml"), ("… as measured", "errors-84.toml")):
        errors, nodes = parameters(HU40 / file), 2
        here = left(errors, nodes)
        while np.linalg.norm(here - (there := left(errors, nodes + 1))) >= 1e-4:
            nodes, here = nodes + 1, there
        found[name] = nodes


def chapter_7(found):
    machine = Machine(HURON / "machine.toml")
    errors = parameters(HURON / "errors-13.toml")
    random = np.random.default_rng(2)
    # Levers (mm) of Table 7-2: the effect (µm) of a parameter by its value.
    printed = {"EXX1": 3.0, "EYY1": 1.8, "EZZ1": 11.3, "EA0Z": 17.2}
    x, y, height, above = (1e-3 * printed[n] / abs(errors[n]) for n in printed)
    part = 2 * x / 650 + 2 * y / 700
    half = {"X": 2 * x, "Y": 2 * y, "Z": part * 225}
    machine.tip[1] = height - above
    q = {axis["name"]: random.uniform(*axis["range"], 20000) for axis in machine.axes}
    for name, middle in (("X", 0), ("Y", 0), ("Z", height)):
        q[name] = middle + random.uniform(-half[name], half[name], 20000)
    found["mean error: before"] = lengths(machine.error(q, errors)).mean()
    later = parameters(HURON / "errors-13-after.toml")
    found["mean error: after"] = lengths(machine.error(q, later)).mean()
    for name in ("EZZ1", "EA0Z", "EB0A"):
        found[f"mean error by {name}, before"] = lengths(machine.error(q, {name: errors[name]})).mean()


def main():
    found = {}
    chapters_5_and_6(found)
    ball_bar(found, np.array([float(c) for c in sys.argv[2:5]]))
    grids(found)
    chapter_7(found)
    print(json.dumps(found, ensure_ascii=False))


if __name__ == "__main__":
    main()
