"""The module beside the command: the same numbers. Run by `cargo xtask python`."""

import csv
import io
import json
import os
import pathlib
import re
import subprocess
import sys
import threading
import time
import unittest
import tempfile

import numpy as np

import trueaxis

ROOT = pathlib.Path(__file__).resolve().parents[2]
EXAMPLES = ROOT / "examples"
COMMAND = os.environ["TRUEAXIS"]


def command(*words):
    done = subprocess.run([COMMAND, *map(str, words)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


def table(text):
    lines = [line for line in text.splitlines() if line]
    return np.array([[float(v) for v in line.split(",")] for line in lines[1:]])


def positions(machine, count, seed=1):
    low, high = machine.travel.T
    return np.random.default_rng(seed).uniform(low, high, (count, len(low)))


def files(name, errors):
    folder = EXAMPLES / name
    machine = trueaxis.Machine.from_file(folder / "machine.toml")
    return folder, machine, trueaxis.Errors.from_file(folder / errors, machine)


def spoken(text):
    """Words of a message without the marks that frame it on a screen."""
    return " ".join(word for word in text.split() if word not in "│|=")


class Beside(unittest.TestCase):
    """Against the command."""

    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.path = pathlib.Path(self.folder.name)

    def tearDown(self):
        self.folder.cleanup()

    def written(self, machine, rows):
        path = self.path / "positions.csv"
        lines = [",".join(machine.axes)] + [",".join(map(repr, row)) for row in rows.tolist()]
        path.write_text("\n".join(lines) + "\n")
        return path

    def test_a_compensation_has_the_bytes_and_the_bits_of_the_command(self):
        for name, errors in [("huron-k2x8", "errors-13.toml"), ("kolibri", "errors-12.toml")]:
            folder, machine, model = files(name, errors)
            made = trueaxis.compile(machine, model, random=200)
            file = self.path / "own.trax"
            command("compile", folder / "machine.toml", folder / errors, "-o", file, "--random", 200)
            self.assertEqual(made.to_bytes(), file.read_bytes())
            rows = positions(machine, 500)
            theirs = table(command("eval", file, "--positions", self.written(machine, rows)))
            for array in [rows, np.asfortranarray(rows), np.repeat(rows, 2, axis=0)[::2]]:
                self.assertTrue((made.evaluate(array) == theirs.astype(np.float32)).all(), name)
            single = rows.astype(np.float32)
            theirs = table(command("eval", file, "--positions", self.written(machine, single)))
            again = trueaxis.Compensation.from_file(file)
            self.assertTrue((again.evaluate(single) == theirs.astype(np.float32)).all())

    def test_directions_are_those_of_the_rows_or_unknown(self):
        _, machine, model = files("kolibri", "errors-12.toml")
        made = trueaxis.compile(machine, model, random=200)
        rows = positions(machine, 50)
        alone = np.vstack([made.evaluate(row[None]) for row in rows])
        self.assertTrue((made.evaluate(rows, motion=False) == alone).all())
        self.assertFalse((made.evaluate(rows) == alone).all())

    def test_corrections_and_poses_are_those_of_the_command(self):
        for policy in ["direction", "orientation", "position"]:
            folder, machine, model = files("huron-k2x8", "errors-13.toml")
            rows = positions(machine, 100)
            words = [folder / "machine.toml", folder / "errors-13.toml"]
            words += ["--positions", self.written(machine, rows)]
            theirs = table(command("correct", *words, "--policy", policy))
            own = trueaxis.correct(machine, model, rows, policy=policy)
            # The command prints ten decimals.
            self.assertLess(np.abs(own - theirs).max(), 1e-10)

    def test_probings_and_parameters_are_those_of_the_command(self):
        folder, machine, model = files("kolibri", "errors-10.toml")
        artefact, strategy = folder / "artefact.toml", folder / "strategy.csv"
        found = trueaxis.simulate(machine, model, artefact=artefact, strategy=strategy, noise=1)
        words = [folder / "machine.toml", folder / "errors-10.toml", "--artefact", artefact]
        theirs = command("simulate", "probings", *words, "--strategy", strategy, "--noise", 1)
        self.assertEqual(found.to_csv(), theirs)
        self.assertEqual(found.positions.shape, (len(found), 5))
        file = self.path / "probings.csv"
        found.save(file)
        # From the file, whose numbers are rounded.
        again = trueaxis.Probings.from_file(file, machine)
        own = trueaxis.identify(machine, again, artefact=artefact, model="10")
        errors = self.path / "errors.toml"
        command("identify", folder / "machine.toml", file, "--artefact", artefact, "--model", 10, "-o", errors)
        theirs = trueaxis.Errors.from_file(errors, machine)
        self.assertEqual(own.errors.parameters, theirs.parameters)
        self.assertEqual(own.errors.standard_uncertainty, theirs.standard_uncertainty)
        saved = self.path / "saved.toml"
        own.save(saved)
        again = trueaxis.Errors.from_file(saved, machine)
        self.assertEqual(again.standard_uncertainty, theirs.standard_uncertainty)
        for name, value in model.parameters.items():
            # Noise of 1 µm; six standard uncertainties are beyond chance.
            off = abs(own.parameters[name] - value)
            self.assertLess(off, 6 * own.standard_uncertainty[name], name)

    def test_the_example_makes_its_picture(self):
        folder, machine, model = files("kolibri", "errors-10.toml")
        artefact = folder / "artefact.toml"
        strategy = folder / "strategy.csv"
        probings = self.path / "probings.csv"
        trueaxis.simulate(machine, model, artefact=artefact, strategy=strategy, noise=1).save(probings)
        script = ROOT / "python" / "examples" / "probings_to_plot.py"
        picture = self.path / "picture.svg"
        words = [sys.executable, script, folder / "machine.toml", artefact, probings, picture]
        done = subprocess.run(words, capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("10 parameters", done.stdout)
        last = done.stdout.splitlines()[-1]
        before, after = (float(word) for word in last.split() if word[0].isdigit())
        self.assertLess(after, before / 50, last)
        self.assertIn("without compensation", picture.read_text().replace("<!-- ", ""))


    def alike(self, own, theirs, place):
        if isinstance(theirs, dict):
            self.assertEqual(list(own), list(theirs), place)
            for key in theirs:
                self.alike(own[key], theirs[key], f"{place}.{key}")
        elif isinstance(theirs, list):
            self.assertEqual(len(own), len(theirs), place)
            for number, value in enumerate(theirs):
                self.alike(own[number], value, f"{place}[{number}]")
        elif isinstance(theirs, float):
            # The same code, built with other optimisations.
            self.assertAlmostEqual(own, theirs, delta=1e-9 * max(1.0, abs(theirs)), msg=place)
        else:
            self.assertEqual(own, theirs, place)

    def same_identification(self, name, machine, probings, artefact, **options):
        """Outcome, warnings and refusal of both; the exit code of the command."""
        words = [COMMAND, "identify", EXAMPLES / "kolibri" / "machine.toml", probings, "--artefact", artefact]
        words += ["--model", options.get("model", "auto")]
        words += ["--robust"] * options.get("robust", False)
        words += ["--accept-places"] * options.get("accept_places", False)
        for rows in options.get("without", []):
            words += ["--without", rows]
        for file in options.get("observations", []):
            words += ["--observations", file]
        done = subprocess.run([*map(str, words), "--json"], capture_output=True, text=True)
        said = spoken(done.stderr)
        try:
            read = trueaxis.Probings.from_file(probings, machine)
            found = trueaxis.identify(machine, read, artefact=artefact, **options)
        except trueaxis.Error as error:
            self.assertEqual(done.returncode, 2, f"{name}: {error}")
            for words in (error.message, error.remedy):
                self.assertIn(spoken(words), said, name)
            return 2
        self.assertEqual(done.returncode, int(found.is_doubtful), f"{name}: {said}")
        self.alike(json.loads(found.to_json()), json.loads(done.stdout), name)
        warned = done.stderr.removeprefix("warning: ").split("\nwarning: ") if done.stderr else []
        self.assertEqual(found.warnings, [one.rstrip("\n") for one in warned], name)
        return done.returncode

    def test_identifications_warnings_and_refusals_are_those_of_the_command(self):
        folder, machine, model = files("kolibri", "errors-10.toml")
        artefact = folder / "artefact.toml"
        good = trueaxis.simulate(
            machine, model, artefact=artefact, strategy=folder / "strategy.csv", noise=1
        ).to_csv()
        observed = self.path / "mixed.csv"
        words = [folder / "machine.toml", folder / "errors-10.toml", "--strategy", folder / "observations.csv"]
        command("simulate", "observations", *words, "-o", observed)

        def changed(change):
            rows = list(csv.DictReader(io.StringIO(good)))
            for number, row in enumerate(rows):
                change(number, row)
            path = self.path / "probings.csv"
            with path.open("w", newline="") as file:
                writer = csv.DictWriter(file, rows[0], lineterminator="\n")
                writer.writeheader()
                writer.writerows(rows)
            return path

        def scaled(axis, factor):
            return lambda _, row: row.update({axis: repr(float(row[axis]) * factor)})

        def moved(line, axis, by):
            return lambda n, row: n == line and row.update({axis: repr(float(row[axis]) + by)})

        def renamed(line, ball):
            return lambda n, row: n == line and row.update({"ball": ball})

        far = self.path / "far.toml"
        place = next(line for line in artefact.read_text().splitlines() if line.startswith("nominal_mm"))
        x = place.split("[")[1].split(",")[0]
        far.write_text(artefact.read_text().replace(f"[{x},", f"[{float(x) + 12.0},", 1))
        as_they_are = lambda number, row: None
        right = [
            ("model 10", as_they_are, artefact, {"model": "10"}),
            ("model 12", as_they_are, artefact, {"model": "12"}),
            ("auto, with instruments", as_they_are, artefact, {"observations": [observed]}),
            ("robust", as_they_are, artefact, {"model": "10", "robust": True}),
            ("without a ball", as_they_are, artefact, {"model": "10", "without": ["ball 3", "line 20"]}),
        ]
        mistaken = [
            ("a ball 12 mm off", as_they_are, far, {"model": "10"}),
            ("that ball, accepted", as_they_are, far, {"model": "10", "accept_places": True}),
            ("an axis in inches", scaled("X", 1 / 25.4), artefact, {"model": "10"}),
            ("A counts the other way", scaled("A", -1.0), artefact, {"model": "10"}),
            ("a row 0.2 mm off", moved(17, "Y", 0.2), artefact, {"model": "10"}),
            ("another ball", renamed(20, "2"), artefact, {"model": "10"}),
            ("rows that are not there", as_they_are, artefact, {"model": "10", "without": ["ball 9"]}),
        ]
        codes = {}
        for name, change, places, options in right + mistaken:
            codes[name] = self.same_identification(name, machine, changed(change), places, **options)
        self.assertTrue(all(codes[case[0]] == 0 for case in right), codes)
        refused = [name for name, code in codes.items() if code == 2]
        for name in ["a ball 12 mm off", "an axis in inches", "A counts the other way", "rows that are not there"]:
            self.assertIn(name, refused)

    def test_compensations_warnings_and_refusals_are_those_of_the_command(self):
        cases = [
            ("huron-k2x8", "errors-13.toml", {}),
            ("huron-k2x8", "errors-13.toml", {"tolerance": 2.0}),
            ("huron-k2x8", "errors-13.toml", {"policy": "orientation"}),
            ("kolibri", "errors-12.toml", {}),
            ("mill-21", "errors-21.toml", {"tolerance": 0.5}),
            # Refused, or with a warning.
            ("huron-k2x8", "errors-13.toml", {"scheme": "grid3d", "policy": "position"}),
            ("huron-k2x8", "errors-13.toml", {"scheme": "nothing"}),
            ("kolibri", "errors-81.toml", {"tolerance": 0.05}),
            ("huron-k2x8", "ten times", {}),
            ("huron-k2x8", "a hundred times", {}),
        ]
        for number, (name, errors, options) in enumerate(cases):
            folder = EXAMPLES / name
            file = folder / errors
            if not file.exists():
                factor = {"ten times": 10, "a hundred times": 100}[errors]
                file = self.path / "errors.toml"
                text = (folder / "errors-13.toml").read_text().split("[standard_uncertainty]")[0]
                larger = lambda found: f"= {float(found[1]) * factor!r}"
                file.write_text(re.sub(r"= (-?[\d.]+e-\d)", larger, text))
            machine = trueaxis.Machine.from_file(folder / "machine.toml")
            out = self.path / f"{number}.trax"
            words = [folder / "machine.toml", file, "-o", out, "--random", 200]
            for option, value in options.items():
                words += [f"--{option}", value]
            done = subprocess.run([COMMAND, "compile", *map(str, words)], capture_output=True, text=True)
            said = spoken(done.stderr)
            place = f"{name} {errors} {options}"
            try:
                model = trueaxis.Errors.from_file(file, machine)
                made = trueaxis.compile(machine, model, random=200, **options)
            except trueaxis.Error as error:
                self.assertNotEqual(done.returncode, 0, f"{place}: {error}")
                for part in error.message.split("; "):
                    self.assertIn(spoken(part), said, place)
                continue
            self.assertEqual(done.returncode, 0, f"{place}: {said}")
            self.assertEqual(made.to_bytes(), out.read_bytes(), place)
            warned = [line[9:] for line in done.stderr.splitlines() if line.startswith("warning: ")]
            self.assertEqual([one.splitlines()[0] for one in made.warnings], warned, place)


class Alone(unittest.TestCase):
    def test_errors_say_where_and_what_to_do(self):
        _, machine, model = files("huron-k2x8", "errors-13.toml")
        text = (EXAMPLES / "huron-k2x8" / "errors-13.toml").read_text()
        line = text[: text.index("[parameters]")].count("\n") + 2
        with self.assertRaises(trueaxis.Error) as caught:
            trueaxis.Errors.from_toml(text.replace("[parameters]", "[parameters]\nEQQ1 = 0.0"), machine)
        self.assertEqual(caught.exception.line, line)
        self.assertIn("EQQ1", caught.exception.message)
        self.assertIn("write", caught.exception.remedy)
        self.assertIsInstance(caught.exception, ValueError)
        with self.assertRaises(FileNotFoundError):
            trueaxis.Machine.from_file("no such file")
        made = trueaxis.compile(machine, model, random=200)
        good = positions(machine, 3)
        for bad, words in [
            (good[:, :4], "4 columns instead of 5"),
            (good.tolist(), "two-dimensional array"),
            (good.astype(int), "two-dimensional array"),
            (np.where(np.arange(5) == 1, np.nan, good), "row 0: the position of A is not finite"),
        ]:
            with self.assertRaisesRegex(trueaxis.Error, words):
                made.evaluate(bad)
        with self.assertRaisesRegex(trueaxis.Error, "checksum"):
            blob = bytearray(made.to_bytes())
            blob[200] ^= 1
            trueaxis.Compensation.from_bytes(bytes(blob))
        other = trueaxis.Machine.from_file(EXAMPLES / "kolibri" / "machine.toml")
        with self.assertRaisesRegex(trueaxis.Error, "another machine"):
            trueaxis.compile(other, model)
        with self.assertRaisesRegex(trueaxis.Error, "is not a policy"):
            trueaxis.correct(machine, model, good, policy="none")
        self.assertEqual(made.evaluate(good[:0]).shape, (0, 5))

    def test_other_threads_run_while_it_evaluates(self):
        _, machine, model = files("huron-k2x8", "errors-13.toml")
        made = trueaxis.compile(machine, model, random=200)
        rows = positions(machine, 2_000_000)
        seen = []
        thread = threading.Thread(target=lambda: seen.append(made.evaluate(rows).shape))
        thread.start()
        ticks = 0
        while thread.is_alive():
            ticks += 1
            time.sleep(0.001)
        thread.join()
        self.assertEqual(seen, [(2_000_000, 5)])
        # Tens of milliseconds without the lock; with it, this thread would have come back once or twice.
        self.assertGreater(ticks, 10)

    def test_the_example_for_the_arena_is_scored(self):
        with tempfile.TemporaryDirectory() as folder:
            at = pathlib.Path(folder)
            arena = [os.environ["ARENA"], "2"]
            subprocess.run([*arena, "--export", at / "round"], check=True, capture_output=True)
            example = ROOT / "python" / "examples" / "arena.py"
            subprocess.run(
                [sys.executable, example, at / "round", at / "mine"], check=True, capture_output=True
            )
            scored = subprocess.run(
                [*arena, "--score", at / "mine"], check=True, capture_output=True, text=True
            ).stdout
        # The first table is of both machines: failed, worse than nothing, tip.
        rows = [line.split("|") for line in scored.splitlines() if line.startswith("| ")]
        none, mine = ([cell.strip() for cell in row] for row in rows[2:4])
        self.assertEqual([none[1], mine[1]], ["none", "python"])
        self.assertEqual(mine[2:4], ["0", "0"])
        median = [float(row[4].split(" / ")[0]) for row in (none, mine)]
        self.assertLess(median[1], median[0] / 10)

    def test_the_stubs_have_every_name(self):
        stubs = (pathlib.Path(trueaxis.__file__).parent / "__init__.pyi").read_text()
        for name in trueaxis.__all__:
            self.assertRegex(stubs, rf"(?m)^(class|def) {name}\b")
            thing = getattr(trueaxis, name)
            if isinstance(thing, type) and name != "Error":
                for member in (m for m in vars(thing) if not m.startswith("_")):
                    self.assertIn(f"def {member}(", stubs, f"{name}.{member}")


if __name__ == "__main__":
    unittest.main()
