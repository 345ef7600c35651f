"""The module beside the command: the same numbers. `cargo xtask python` runs it with pytest on the installed wheel."""

import copy
import csv
import io
import json
import os
import pathlib
import pickle
import re
import signal
import subprocess
import sys
import threading
import time
import unittest
import tempfile
import warnings

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
        artefact, plan = folder / "artefact.toml", folder / "plan.csv"
        found = trueaxis.simulate(machine, model, artefact=artefact, plan=plan, noise=1)
        words = [folder / "machine.toml", folder / "errors-10.toml", "--artefact", artefact]
        theirs = command("simulate", "probings", *words, "--plan", plan, "--noise", 1)
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
        plan = folder / "plan.csv"
        probings = self.path / "probings.csv"
        trueaxis.simulate(machine, model, artefact=artefact, plan=plan, noise=1).save(probings)
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

    def test_the_proof_has_the_figures_of_the_command(self):
        folder, machine, model = files("huron-k2x8", "errors-13.toml")
        made = trueaxis.compile(machine, model, random=200)
        words = ["compile", folder / "machine.toml", folder / "errors-13.toml", "-o", self.path / "own.trax"]
        theirs = json.loads(command(*words, "--random", 200, "--json"))
        self.alike(made.verification, {key: theirs[key] for key in made.verification}, "verification")
        self.assertIsNone(trueaxis.Compensation.from_bytes(made.to_bytes()).verification)

    def test_circles_are_those_of_the_report(self):
        from trueaxis import _paths

        # The second has a tool length, the third backlash.
        for name, machine, errors in [
            ("kolibri", "machine.toml", "errors-12.toml"),
            ("huron-k2x8", "machine-tool-length.toml", "errors-13.toml"),
            ("router", "machine.toml", "errors-10.toml"),
        ]:
            folder = EXAMPLES / name
            words = [folder / machine, folder / errors]
            file = self.path / "circle.trax"
            command("compile", *words, "-o", file, "--random", 200, "--best-effort")
            report = json.loads(command("report", *words, file, "--random", 200, "--json"))
            described = trueaxis.Machine.from_file(folder / machine)
            model = trueaxis.Errors.from_file(folder / errors, described)
            made = trueaxis.Compensation.from_file(file)
            for circle in report["tests"]["circles"]:
                for found, tables in [(circle["before"], None), (circle["after"], made)]:
                    _, own, radius = _paths.circle(model, tables, circle["plane"])
                    self.assertEqual(radius, circle["radius_mm"])
                    # Corrections are f32, of positions that the two round differently.
                    off = np.abs(own - found["readings_um"]) > 1e-2
                    # In the report an axis has reversed at once; along rows, after its reversal_threshold: the first of the 1.5°
                    # steps may fall short of it, once for each of two axes, twice a turn, in two turns.
                    self.assertLessEqual(off.sum(), 8 if name == "router" else 0, f"{name} {circle['plane']}")

    def test_the_notebook_runs_and_shows_its_results(self):
        notebook = json.loads((ROOT / "python" / "examples" / "notebook.ipynb").read_text())
        environment = {**os.environ, "MPLBACKEND": "agg"}
        cells = ["".join(cell["source"]) for cell in notebook["cells"] if cell["cell_type"] == "code"]
        # A notebook shows the value of the last line.
        shown = "; ".join(f"print(getattr({last}, '_repr_html_', str)())" for last in ["found", "compensation"])
        done = subprocess.run(
            [sys.executable, "-c", "\n".join([*cells, shown])],
            capture_output=True,
            text=True,
            cwd=ROOT / "python" / "examples",
            env=environment,
        )
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(done.stdout.count("<svg"), 2)
        self.assertIn("EC0X", done.stdout)

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
            machine, model, artefact=artefact, plan=folder / "plan.csv", noise=1
        ).to_csv()
        observed = self.path / "mixed.csv"
        words = [folder / "machine.toml", folder / "errors-10.toml", "--plan", folder / "observations.csv"]
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
        for read in [trueaxis.Machine.from_file, trueaxis.Compensation.from_file]:
            with self.assertRaises(FileNotFoundError) as caught:
                read(pathlib.Path("no such file"))
            self.assertEqual(caught.exception.filename, "no such file")
        made = trueaxis.compile(machine, model, random=200)
        good = positions(machine, 3)
        for bad, words in [
            (good[:, :4], "4 columns instead of 5"),
            ([["a"] * 5], "positions must be numbers"),
            ([[[0.0]]], "3 dimensions"),
            ({"X": 1.0}, "positions must be numbers"),
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

    def test_anything_that_numpy_takes_is_a_position(self):
        _, machine, model = files("huron-k2x8", "errors-13.toml")
        made = trueaxis.compile(machine, model, random=200)
        whole = np.array([[10, 20, 30, 40, 50], [11, 21, 31, 41, 51]])

        class Table(dict):
            """As pandas and polars have them: named columns, and others."""

            columns = property(list)

            def __getitem__(self, names):
                return Table({name: self.get(name) for name in names})

            def to_numpy(self):
                return np.column_stack(list(self.values()))

        table = Table({name: whole[:, machine.axes.index(name)] for name in "ACXYZ"}, note=["a", "b"])
        calls = [
            made.evaluate,
            lambda rows: trueaxis.correct(machine, model, rows),
            lambda rows: np.concatenate(trueaxis.pose(machine, rows, model), axis=-1),
        ]
        for call in calls:
            expected = call(whole.astype(float))
            for same in [whole, whole.tolist(), tuple(map(tuple, whole)), table]:
                self.assertTrue((call(same) == expected).all())
            alone = call(whole[0])
            self.assertEqual(alone.shape, expected[0].shape)
            self.assertTrue((alone == call(whole[:1])[0]).all())
        with self.assertRaisesRegex(trueaxis.Error, "no column A, Z"):
            made.evaluate(Table({name: [0.0] for name in "CXY"}))

    def test_objects_are_compared_copied_and_pickled(self):
        folder, machine, model = files("kolibri", "errors-10.toml")
        measured = trueaxis.Errors.from_file(folder / "errors-81.toml", machine)
        places = {"artefact": folder / "artefact.toml"}
        probings = trueaxis.simulate(machine, model, plan=folder / "plan.csv", noise=1, **places)
        found = trueaxis.identify(machine, probings, model="10", **places)
        made = trueaxis.compile(machine, found.errors, random=200)
        others = [files("huron-k2x8", "errors-13.toml")[1], trueaxis.Errors.perfect(machine)]
        objects = [machine, model, measured, probings, found, found.errors, made]
        for one in objects:
            for same in [pickle.loads(pickle.dumps(one)), copy.copy(one), copy.deepcopy(one)]:
                self.assertEqual(one, same)
                self.assertEqual(repr(one), repr(same))
            for other in [*objects, *others, None]:
                self.assertTrue(one is other or one != other)
        again = pickle.loads(pickle.dumps(made))
        self.assertEqual((again.verification, again.warnings), (made.verification, made.warnings))

    def test_errors_of_a_dictionary_are_those_of_a_file(self):
        _, machine, model = files("huron-k2x8", "errors-13.toml")
        same = trueaxis.Errors.from_dict(
            model.parameters, machine, standard_uncertainty=model.standard_uncertainty
        )
        self.assertEqual(same.parameters, model.parameters)
        self.assertEqual(trueaxis.Errors.from_toml(same.to_toml(), machine), same)
        with self.assertRaisesRegex(trueaxis.Error, "EQQ1") as caught:
            trueaxis.Errors.from_dict({"EQQ1": 1e-6}, machine)
        self.assertIsNone(caught.exception.line)
        for value in [float("nan"), float("inf")]:
            with self.assertRaisesRegex(trueaxis.Error, "not finite"):
                trueaxis.Errors.from_dict({"EXX1": value}, machine)
        for value in ["30 um", None]:
            with self.assertRaisesRegex(trueaxis.Error, "EXX1: .* is not a number") as caught:
                trueaxis.Errors.from_dict({"EXX1": value}, machine)
            self.assertIn("30e-3", str(caught.exception))

    def test_doubts_are_warnings_of_python(self):
        _, machine, _ = files("huron-k2x8", "errors-13.toml")
        text = machine.to_toml().replace("[-120.0, 120.0]", "[-2.0, 2.0]")
        with self.assertWarnsRegex(trueaxis.TrueaxisWarning, "A") as caught:
            trueaxis.Machine.from_toml(text)
        self.assertEqual(caught.filename, __file__)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            with self.assertRaises(trueaxis.TrueaxisWarning):
                trueaxis.Machine.from_toml(text)

    def test_ctrl_c_ends_long_calls(self):
        # A program that was started in the background ignores the key.
        self.addCleanup(signal.signal, signal.SIGINT, signal.signal(signal.SIGINT, signal.default_int_handler))
        _, machine, model = files("kolibri", "errors-81.toml")
        made = trueaxis.compile(machine, files("kolibri", "errors-12.toml")[2], random=200)
        rows = np.tile(machine.travel.mean(axis=1), (1_000_000, 1))
        many = np.tile(rows, (20, 1))
        calls = {
            "compile": lambda: trueaxis.compile(machine, model, tolerance=0.01, target="desktop", random=500_000, allow_large=True),
            "correct": lambda: trueaxis.correct(machine, model, rows),
            "pose": lambda: trueaxis.pose(machine, rows, model),
            "evaluate": lambda: made.evaluate(many),
        }
        for name, call in calls.items():
            pressed = f"import os, time; time.sleep(0.1); print(time.time(), flush=True); os.kill({os.getpid()}, 2)"
            with subprocess.Popen([sys.executable, "-S", "-c", pressed], stdout=subprocess.PIPE) as key:
                with self.assertRaises(KeyboardInterrupt, msg=name):
                    call()
                    # It was done before the key was pressed.
                    key.wait()
                    time.sleep(1)
                noticed = time.time()
                late = noticed - float(key.stdout.read())
            # 0.05 s between two looks; the rest is the computer's, which has other work.
            self.assertLess(late, 1.0, name)

    def test_names_have_help_and_leave_those_of_python_alone(self):
        spaces = {}
        exec("from trueaxis import *", spaces)
        self.assertNotIn("compile", spaces)
        self.assertIs(spaces["pose"], trueaxis.pose)
        self.assertRegex(trueaxis.__version__, r"^\d+\.\d+\.\d+$")
        for name in [*trueaxis.__all__, "compile"]:
            thing = getattr(trueaxis, name)
            self.assertTrue(thing.__doc__, name)
            # The parts of an exception have no help of their own.
            if isinstance(thing, type) and not issubclass(thing, Exception):
                for member in (m for m in vars(thing) if not m.startswith("_")):
                    self.assertTrue(getattr(thing, member).__doc__, f"{name}.{member}")

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
        for name in [*trueaxis.__all__, "compile"]:
            self.assertRegex(stubs, rf"(?m)^(class|def) {name}\b")
            thing = getattr(trueaxis, name)
            if isinstance(thing, type) and not issubclass(thing, Exception):
                for member in (m for m in vars(thing) if not m.startswith("_")):
                    self.assertIn(f"def {member}(", stubs, f"{name}.{member}")


if __name__ == "__main__":
    unittest.main()
