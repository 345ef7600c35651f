"""The module beside the command: the same numbers. Run by `cargo xtask python`."""

import os
import pathlib
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
