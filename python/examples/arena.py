"""A submission to the arena: from the measurements of every machine of a round to compensations.

    cargo xtask arena --export ROUND
    python arena.py ROUND SUBMISSION
    cargo xtask arena --score SUBMISSION
"""

import pathlib
import re
import sys

import numpy as np

import trueaxis

# An interval of 95 %, in standard uncertainties.
EXPANDED = 1.96


def answer(machine_folder, own):
    """Writes the answer for one machine, if its parameters can be found."""
    machine = trueaxis.Machine.from_file(machine_folder / "machine.toml")
    asked = (machine_folder / "asked.csv").read_text().split()[1:]
    if not asked:
        return None  # it warms up, and the module identifies no temperatures
    measured = {}
    if (machine_folder / "probings.csv").exists():
        measured["probings"] = trueaxis.Probings.from_file(machine_folder / "probings.csv", machine)
        measured["artefact"] = machine_folder / "artefact.toml"
    else:
        measured["observations"] = [machine_folder / "points.csv"]
    found = trueaxis.identify(machine, model=",".join(asked), **measured)
    made = trueaxis.compile(
        machine, found.errors, tolerance=1.0, target="desktop", best_effort=True, random=2000
    )
    own.mkdir()
    made.save(own / "compensation.trax")
    rows = [
        f"{name},{value!r},{EXPANDED * found.standard_uncertainty[name]!r}\n"
        for name, value in found.parameters.items()
    ]
    (own / "parameters.csv").write_text("parameter,value,band\n" + "".join(rows))

    # What the tables leave of the errors that were found, and twice the noise of a coordinate for what was not.
    positions = np.loadtxt(machine_folder / "positions.csv", delimiter=",", skiprows=1)
    corrected = positions + made.evaluate(positions, motion=False)
    wanted, along = trueaxis.pose(machine, positions)
    tip, direction = trueaxis.pose(machine, corrected, found.errors)
    um = 1e3 * np.linalg.norm(tip - wanted, axis=1) + 2 * found.noise_um
    urad = 1e6 * np.linalg.norm(direction - along, axis=1) + 20 * found.noise_um
    bands = np.column_stack([um, urad])
    np.savetxt(own / "bands.csv", bands, "%.4f", ",", header="band_um,band_urad", comments="")
    return um.mean()


def main(round_folder, submission):
    round_folder, submission = pathlib.Path(round_folder), pathlib.Path(submission)
    mark = re.search('round = "(.*)"', (round_folder / "arena.toml").read_text()).group(1)
    submission.mkdir()
    (submission / "submission.toml").write_text(f'name = "python"\nround = "{mark}"\n')
    for folder in sorted(path for path in round_folder.iterdir() if path.is_dir()):
        band = answer(folder, submission / folder.name)
        print(folder.name, "not corrected" if band is None else f"tip within {band:.1f} µm")


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(*sys.argv[1:])
