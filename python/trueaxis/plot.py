"""Drawings with matplotlib: ``trueaxis.plot.circle(errors, compensation)``.

Every function draws into ``ax``, or into new axes, and returns them. Errors know their machine.
"""

import matplotlib.pyplot as plt
import numpy as np

from . import _paths
from ._native import Error, Errors

__all__ = ["budget", "circle", "field", "residuals"]


# Way (mm) to a point, which settles the direction of travel.
APPROACH = 1.0


def circle(errors, compensation=None, *, plane="XY", radius=None, ax=None):
    """The circular test (ISO 230-4) of a machine with these errors, without and with a compensation.

    ``radius`` (mm) is that of the longest ball-bar for which there is room, unless it is given. Deviations are drawn
    outwards from the dashed circle.
    """
    if ax is None:
        _, ax = plt.subplots(subplot_kw={"projection": "polar"})
    angles, before, radius = _paths.circle(errors, None, plane, radius)
    ax.plot(angles, before, color="C3", label="without tables")
    if compensation is not None:
        angles, after, _ = _paths.circle(errors, compensation, plane, radius)
        ax.plot(angles, after, color="C0", label="with tables")
    end = _paths.scale(before)
    ax.plot(np.linspace(0, 2 * np.pi, 200), np.zeros(200), "--", color="grey", linewidth=0.8)
    ax.set_ylim(-2 * end, 1.1 * end)
    ax.set_yticks([-end, 0.0, end])
    ax.set_title(f"{plane}, radius {radius:g} mm: radial deviation (µm)")
    ax.legend(loc="lower right")
    return ax


def budget(errors, *, positions=500, seed=1, ax=None):
    """The mean error of the tip that each parameter causes alone, at random positions, the largest first."""
    if not errors.parameters:
        raise Error("the errors have no parameters")
    drawn = _random(errors, positions, seed)
    means = {}
    for name, value in errors.parameters.items():
        alone = Errors.from_dict({name: value}, errors.machine)
        columns = len(_paths.middle(alone))
        nominal, actual = _paths.moved(alone, None, drawn[:, :columns])
        means[name] = 1e3 * np.linalg.norm(actual - nominal, axis=1).mean()
    order = sorted(means, key=means.get)
    ax = _axes(ax)
    ax.barh(order, [means[name] for name in order])
    ax.set_xlabel("mean error of the tip (µm)")
    return ax


def field(errors, compensation=None, *, plane="XY", points=9, ax=None):
    """Errors of the tip over a plane of two of X, Y and Z, as exaggerated arrows; the other axes rest in the middle.

    Each point is approached in the positive direction.
    """
    columns = [errors.machine.axes.index(letter) for letter in plane]
    lines = [np.linspace(*errors.machine.travel[column], points) for column in columns]
    grid = np.stack(np.meshgrid(*lines), axis=-1).reshape(-1, 2)
    path = np.tile(_paths.middle(errors), (len(grid), 1))
    path[:, columns] = grid
    before = path.copy()
    before[:, columns] -= APPROACH
    path = np.stack([before, path], axis=1).reshape(2 * len(path), -1)
    nominal, actual = _paths.moved(errors, compensation, path)
    shown = ["XYZ".index(letter) for letter in plane]
    off = 1e3 * (actual - nominal)[1::2, shown]
    ax = _axes(ax)
    arrows = ax.quiver(*grid.T, *off.T, np.linalg.norm(off, axis=1), angles="xy", cmap="viridis")
    ax.figure.colorbar(arrows, ax=ax, label="error of the tip in the plane (µm)")
    ax.set_xlabel(f"{plane[0]} (mm)")
    ax.set_ylabel(f"{plane[1]} (mm)")
    ax.set_aspect("equal")
    return ax


def residuals(identified, *, ax=None):
    """What each probing is off by, without the errors found and with them."""
    before, after = (np.linalg.norm(one, axis=1) for one in identified.residuals_um)
    ax = _axes(ax)
    ax.semilogy(before, ".", color="C3", label="without the errors found")
    ax.semilogy(after, ".", color="C0", label="with them")
    ax.set_xlabel("probing")
    ax.set_ylabel("residual (µm)")
    ax.legend()
    return ax


def _axes(ax):
    return plt.subplots()[1] if ax is None else ax


def _random(errors, count, seed):
    low, high = errors.machine.travel.T
    drawn = np.tile(_paths.middle(errors), (count, 1))
    drawn[:, : len(low)] = np.random.default_rng(seed).uniform(low, high, (count, len(low)))
    return drawn
