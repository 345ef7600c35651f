//! The figures of the manual that no command prints in that form. The output of commands is compared in
//! `host/cli/tests/command/shown.rs`.

use trueaxis_model::errors::{Situation, Switches};
use trueaxis_model::kinematics::{Kinematics, Policy};
use trueaxis_model::validate::{Region, Runtime, random_commands, verify};
use trueaxis_tables::compile::{self, Options};
use trueaxis_tables::schemes::exact::Minimize;
use trueaxis_tables::schemes::{self, Scheme};
use trueaxis_tests::{errors, machine, read, usual_or_all};

#[track_caller]
fn shows(file: &str, line: &str) {
    let text = read(file);
    assert!(
        text.lines().any(|l| l == line),
        "{file} does not show `{line}`: run the commands it shows again"
    );
}

/// Rows of the manual, machines and errors: the examples with 10, 12 or 13 errors.
const ROWS: &str = "\
Huron, 13 errors                   | huron-k2x8/machine             | huron-k2x8/errors-13
… with the tool length as an input | huron-k2x8/machine-tool-length | huron-k2x8/errors-13
Kolibri, 10 errors                 | kolibri/machine                | kolibri/errors-10
Kolibri, 12 errors                 | kolibri/machine                | kolibri/errors-12
HU40, 13 errors                    | hu40/machine                   | hu40/errors-13
fork head, 13 errors               | fork-head/machine              | fork-head/errors-13
table-head, 13 errors              | table-head/machine             | table-head/errors-13
router, 10 errors                  | router/machine                 | router/errors-10";

/// All of them, or `usual` ones.
fn rows(usual: usize) -> impl Iterator<Item = (&'static str, [&'static str; 2])> {
    let rows = ROWS.lines().map(|line| {
        let mut cells = line.split('|').map(str::trim);
        [(); 3].map(|()| cells.next().unwrap())
    });
    let rows = rows.map(|[row, machine, errors]| (row, [machine, errors]));
    rows.take(usual_or_all(usual, usize::MAX))
}

/// Every example with 10, 12 or 13 errors: its row in the manual, and the tolerance, everywhere.
#[test]
fn the_manual_counts_the_tables_of_every_example_and_they_meet_the_tolerance() {
    for (row, [machine, errors]) in rows(3) {
        let machine = self::machine(&format!("examples/{machine}.toml"));
        let errors = self::errors(&format!("examples/{errors}.toml"), &machine);
        let [by_cost, by_tables] = [Minimize::Cost, Minimize::Tables].map(|minimize| {
            let options = Options {
                scheme: Scheme::Exact { minimize },
                tables: schemes::Options {
                    policy: Policy::Orientation,
                    ..schemes::Options::default()
                },
                ..Options::default()
            };
            let built = compile::build(&machine, &errors, &options, &()).unwrap();
            let runtime = Runtime::load(&built.blob).unwrap();
            let kinematics = runtime.kinematics(&machine, &errors);
            let commands = random_commands(&kinematics, Region::Travel, 2000, 7).unwrap();
            let zero = Default::default();
            let verification =
                verify(&machine, &errors, &runtime, &zero, &commands, || {}).unwrap();
            assert!(
                verification.difference_um <= 0.05 && verification.difference_urad <= 0.05,
                "{row}: {} µm, {} µrad",
                verification.difference_um,
                verification.difference_urad
            );
            built.size
        });
        shows(
            "docs/evidence/reproduction.md",
            &format!(
                "| {row} | {} | {} | {} |",
                by_cost.tables, by_cost.terms, by_tables.tables
            ),
        );
    }
}

/// With the default policy: rows in the manual, the permitted size relative to `orientation`, and the capacity in bytes of
/// controllers.
#[test]
fn the_manual_counts_what_the_direction_takes() {
    // For all but two; the manual explains why these take more.
    let more = ["fork head, 13 errors", "Kolibri, 12 errors"];
    for (row, [machine, errors]) in rows(3) {
        let bytes = match row {
            "Huron, 13 errors" | "… with the tool length as an input" => 8_000,
            "fork head, 13 errors" => 10_000,
            _ => 24_000,
        };
        let machine = self::machine(&format!("examples/{machine}.toml"));
        let errors = self::errors(&format!("examples/{errors}.toml"), &machine);
        let [direction, orientation] = [Policy::default(), Policy::Orientation].map(|policy| {
            let options = Options {
                tables: schemes::Options {
                    policy,
                    ..schemes::Options::default()
                },
                random: 5000,
                ..Options::default()
            };
            compile::compile(&machine, &errors, &options, &()).unwrap()
        });
        assert!(direction.verification.meets(0.05), "{row}");
        assert_eq!(direction.verification.travel.direction_worse, 0, "{row}");
        let [size, before] = [direction, orientation].map(|compiled| compiled.built.size);
        assert!(size.bytes <= bytes, "{row}: {} bytes", size.bytes);
        if !more.contains(&row) {
            assert!(5 * size.tables <= 6 * before.tables, "{row}: {size:?}");
            assert!(5 * size.terms <= 6 * before.terms, "{row}: {size:?}");
        }
        shows(
            "docs/evidence/tables.md",
            &format!(
                "| {row} | {} | {} | {} |",
                size.tables, size.terms, size.bytes
            ),
        );
    }
}

/// The examples with many error parameters: their rows in the manual, and their remaining errors.
#[test]
fn the_manual_tells_what_the_large_examples_take_and_what_they_leave() {
    let (reproduction, exact) = ("docs/evidence/reproduction.md", "docs/src/exact.md");
    let compiled = |folder: &str, errors_file: &str, policy: Policy, zero_at: Option<Vec<f64>>| {
        let machine = machine(&format!("examples/{folder}/machine.toml"));
        let errors = errors(&format!("examples/{folder}/{errors_file}.toml"), &machine);
        let options = Options {
            tables: schemes::Options {
                policy,
                zero_at,
                ..schemes::Options::default()
            },
            allow_large: true,
            ..Options::default()
        };
        compile::compile(&machine, &errors, &options, &()).unwrap()
    };
    let contains = |file: &str, shown: String| {
        // Ignores line breaks.
        let text = read(file).split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(text.contains(&shown), "{file} does not say `{shown}`");
    };
    // Y, A, C, X, Z.
    let zero_at = Some(vec![0.0, 0.0, 0.0, 0.0, 150.0]);
    for (row, folder, errors_file, zero_at) in [
        ("HU40, 84 coefficients", "hu40", "errors-84", None),
        (
            "Kolibri, 81 coefficients, `--zero-at X=0,Y=0,Z=150,A=0,C=0`",
            "kolibri",
            "errors-81",
            zero_at,
        ),
        ("mill, 21 errors, measured", "mill-21", "errors-21", None),
        (
            "trunnion, 30 motions, measured",
            "five-axis-30",
            "errors-30",
            None,
        ),
    ]
    .into_iter()
    .take(usual_or_all(1, 4))
    {
        let found = compiled(folder, errors_file, Policy::Orientation, zero_at);
        let size = &found.built.size;
        let shown = format!("| {row} | {} | {} | |", size.tables, size.terms);
        shows(reproduction, &shown);
        let left = found.verification.inside();
        let (um, urad) = (left.difference_um, left.difference_urad);
        match folder {
            "hu40" => contains(reproduction, format!("{um:.3} µm and {urad:.3} µrad")),
            "kolibri" => contains(reproduction, format!("{um:.1} µm and {urad:.1} µrad")),
            _ => assert!(found.verification.meets(0.05), "{row}"),
        }
    }
    let direction = compiled("hu40", "errors-84", Policy::default(), None);
    let um = direction.verification.inside().difference_um;
    contains(exact, format!("{um:.2} µm remain at the tip"));
}

/// Why the Kolibri's ten errors need all twelve products of its linear corrections: at some A each of them varies by
/// more than the tolerance between the ends of the travel.
#[test]
fn none_of_the_twelve_coefficients_of_the_kolibri_is_within_the_tolerance() {
    let machine = machine("examples/kolibri/machine.toml");
    let errors = errors("examples/kolibri/errors-10.toml", &machine);
    let kinematics = Kinematics::new(&machine, &errors).with_policy(Policy::Orientation);
    let place = |letter| machine.index(letter).unwrap();
    let [x, y, z, a] = ['X', 'Y', 'Z', 'A'].map(place);
    // The middle of the travel, and the end of it along each linear axis.
    let middle = |i: usize| 0.5 * (machine.axes[i].travel[0] + machine.axes[i].travel[1]);
    let mut smallest = f64::INFINITY;
    for output in [x, y, z] {
        let mut largest = [0.0_f64; 4];
        for degrees in (-120..=120).step_by(5) {
            let at = |moved: Option<usize>| {
                let mut q = [0.0; 6];
                for i in [x, y, z] {
                    q[i] = middle(i);
                }
                if let Some(i) = moved {
                    q[i] = machine.axes[i].travel[1];
                }
                q[a] = f64::from(degrees).to_radians();
                let all = Switches::ALL;
                kinematics
                    .correction(&q, &Situation::default(), &all)
                    .unwrap()
                    .dq[output]
            };
            let base = at(None);
            largest[0] = largest[0].max(base.abs());
            for (most, i) in largest[1..].iter_mut().zip([x, y, z]) {
                *most = most.max((at(Some(i)) - base).abs());
            }
        }
        smallest = largest.into_iter().fold(smallest, f64::min);
    }
    assert!(smallest > 0.05e-3);
    // 0.06179 µm: the last bits of a mathematical library do not change the third decimal.
    let shown = format!("{:.3} µm", 1e3 * smallest);
    assert!(
        read("docs/evidence/reproduction.md").contains(&shown),
        "{shown}"
    );
}
