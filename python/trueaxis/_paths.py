"""Errors along the paths that are drawn, for ``trueaxis.plot`` and the notebook."""

import numpy as np

from ._native import pose

# Lengths of ball-bars (mm), the longest first.
BARS = (300.0, 250.0, 150.0, 100.0, 50.0, 25.0)
# Steps of a turn, and those before and after it, which settle the directions of travel.
STEPS, OVERSHOOT = 240, 30


def middle(errors):
    """Linear axes in the middle of their travels, rotary ones at zero; auxiliary inputs at their references."""
    machine = errors.machine
    low, high = machine.travel.T
    rotary = np.isin(machine.axes, list("ABC"))
    axes = np.where(rotary, np.clip(0.0, low, high), (low + high) / 2)
    return np.concatenate([axes, errors._references])


def moved(errors, compensation, positions):
    """Nominal and actual tip (mm) at commanded positions, with the corrections of a compensation, if there is one."""
    machine = errors.machine
    nominal, _ = pose(machine, positions[:, : len(machine.inputs)])
    if compensation is not None:
        inputs = [errors.inputs.index(name) for name in compensation.inputs]
        corrections = compensation.evaluate(positions[:, inputs])
        positions = positions.copy()
        positions[:, : len(machine.axes)] += corrections
    actual, _ = pose(machine, positions, errors)
    return nominal, actual


def circle(errors, compensation=None, plane="XY", radius=None):
    """Angles (rad) and radial deviations (µm) of a circular test, there and back, as ``trueaxis report`` simulates it."""
    machine = errors.machine
    columns = [machine.axes.index(letter) for letter in plane]
    low, high = machine.travel[columns].T
    room = (high - low).min() / 2
    if radius is None:
        radius = next((bar for bar in BARS if bar <= room), room)
    forth = np.arange(-OVERSHOOT, STEPS + OVERSHOOT + 1)
    steps = np.concatenate([forth, forth[::-1]])
    angles = steps * (2 * np.pi / STEPS)
    centre = middle(errors)
    path = np.tile(centre, (len(steps), 1))
    path[:, columns[0]] += radius * np.cos(angles)
    path[:, columns[1]] += radius * np.sin(angles)
    nominal, actual = moved(errors, compensation, path)
    nominal_centre, actual_centre = moved(errors, compensation, centre[None])
    bar = np.linalg.norm(nominal - nominal_centre, axis=1)
    deviation = 1e3 * (np.linalg.norm(actual - actual_centre, axis=1) - bar)
    is_read = (steps >= 0) & (steps <= STEPS)
    return angles[is_read], deviation[is_read], radius


def scale(*deviations):
    """A round number of µm, a little above the largest deviation."""
    largest = max(np.abs(one).max() for one in deviations)
    if largest < 1e-3:
        return 1.0
    step = 10.0 ** np.floor(np.log10(largest))
    return float(step * next(n for n in (1, 2, 5, 10) if n * step >= largest))
