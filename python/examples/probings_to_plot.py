"""From probings to a plot: what a compensation does to the error of the tip along a path.

    python probings_to_plot.py MACHINE.toml ARTEFACT.toml PROBINGS.csv PICTURE.svg
"""

import sys

import matplotlib
import numpy as np

import trueaxis

matplotlib.use("svg")
import matplotlib.pyplot as plt  # noqa: E402


def main(machine_file, artefact, probings_file, picture):
    machine = trueaxis.Machine.from_file(machine_file)
    probings = trueaxis.Probings.from_file(probings_file, machine)

    # Which errors explain the probings?
    found = trueaxis.identify(machine, probings, artefact=artefact, model="10")
    print(found)
    for name, value in found.parameters.items():
        print(f"{name:6} {value:+.3e} ± {2 * found.standard_uncertainty[name]:.0e}")

    # Tables that correct them.
    compensation = trueaxis.compile(machine, found.errors)
    print(compensation)

    # The last axis goes from end to end, the others stay in the middle.
    low, high = machine.travel.T
    path = np.tile((low + high) / 2, (400, 1))
    path[:, -1] = np.linspace(low[-1], high[-1], len(path))
    wanted, _ = trueaxis.pose(machine, path)

    def off(positions):
        tip, _ = trueaxis.pose(machine, positions, found.errors)
        return 1e3 * np.linalg.norm(tip - wanted, axis=1)

    before = off(path)
    after = off(path + compensation.evaluate(path))
    print(f"tip off by up to {before.max():.1f} µm, compensated {after.max():.2f} µm")

    figure, axes = plt.subplots()
    axes.semilogy(path[:, -1], before, label="without compensation")
    axes.semilogy(path[:, -1], after, label="with compensation")
    axes.set_xlabel(f"{machine.axes[-1]} (mm)")
    axes.set_ylabel("error of the tip (µm)")
    axes.legend()
    figure.savefig(picture)


if __name__ == "__main__":
    if len(sys.argv) != 5:
        sys.exit(__doc__)
    main(*sys.argv[1:])
