//! The page "From measurement to parameter": every row of its tables, through `explain`, and through the exact model
//! with an independent implementation of the instruments.

use nalgebra::Vector3;
use trueaxis_model::errors::{ErrorModel, Parameter, Situation, Switches};
use trueaxis_model::explain::{
    BenchInstrument, BenchState, InstrumentReading, Nature, REACH, Sense, explain,
};
use trueaxis_model::kinematics::{Htm, Kinematics};
use trueaxis_model::machine::Machine;
use trueaxis_tests::{machine, read};

/// A row: the procedure, with … for the figure; the figure; the entry for each machine.
struct Row {
    done: String,
    shows: f64,
    unit: String,
    written: Vec<(String, String)>,
}

fn rows() -> Vec<Row> {
    let text = read("docs/src/measurement.md");
    let mut machines: Vec<String> = Vec::new();
    let mut rows = Vec::new();
    for line in text.lines() {
        let Some(row) = line
            .strip_prefix("| ")
            .and_then(|line| line.strip_suffix('|'))
        else {
            continue;
        };
        let cells: Vec<&str> = row.split('|').map(str::trim).collect();
        let code = |cell: &&str| cell.replace('`', "");
        if cells[0] == "the instrument" {
            machines = cells[2..].iter().map(code).collect();
            continue;
        }
        let (shows, unit) = cells[1].split_once(' ').unwrap();
        let written = machines.iter().cloned().zip(cells[2..].iter().map(code));
        rows.push(Row {
            done: cells[0].to_owned(),
            shows: shows.parse().unwrap(),
            unit: unit.to_owned(),
            written: written.filter(|(_, written)| !written.is_empty()).collect(),
        });
    }
    rows
}

/// Reading of an instrument on a machine with errors (mm, rad), from exact poses.
fn exact(
    machine: &Machine,
    errors: &ErrorModel,
    nature: Nature,
    reading: &InstrumentReading,
) -> f64 {
    let kinematics = Kinematics::new(machine, errors);
    let nominal = |state: &BenchState| kinematics.nominal(&state.q, None);
    let actual = |state: &BenchState| {
        let situation = Situation {
            sign: state.sign,
            ..Situation::default()
        };
        kinematics.actual(&state.q, &situation, &Switches::ALL)
    };
    // In the workpiece frame: along or about the tool's motion for a positive command.
    let way = |axis: usize, state: &BenchState| -> Vector3<f64> {
        let [x, y, z, a, b, c] = kinematics.jacobian(&state.q, None).column(axis);
        let column = match machine.axes[axis].letter.is_rotary() {
            true => Vector3::new(a, b, c),
            false => Vector3::new(x, y, z),
        };
        nominal(state).r * column
    };
    let (from, to) = (&reading.from, &reading.to);
    let gone = |pose: &dyn Fn(&BenchState) -> Htm| pose(to).t - pose(from).t;
    let tip = gone(&actual) - gone(&nominal);
    let off = |state: &BenchState| actual(state).r * nominal(state).r.transpose();
    let turn = off(to) * off(from).transpose();
    let turn = Htm {
        r: turn,
        t: Vector3::zeros(),
    };
    let turn = turn.twist().r;
    match (reading.instrument, reading.sense) {
        (BenchInstrument::Square, Sense::In(aligned)) => {
            // Both legs as they run: the cosine of the angle between them, which is nominally a right angle.
            let moved = reading.moved.unwrap();
            let mut ahead = *from;
            ahead.q[aligned] += REACH;
            if ahead.q[aligned] > machine.axes[aligned].travel[1] {
                ahead.q[aligned] -= 2.0 * REACH;
            }
            let leg = |q: f64, at: &BenchState| (actual(at).t - actual(from).t) / q;
            let a = leg(ahead.q[aligned] - from.q[aligned], &ahead);
            let b = leg(to.q[moved] - from.q[moved], to);
            a.normalize().dot(&b) * REACH
        }
        (BenchInstrument::Tram, Sense::In(axis)) => {
            // Heights of the two ends of the arm above the table, which is perpendicular to the nominal tool.
            let tool = nominal(to).r.column(machine.tool_axis).into_owned();
            let height = |side: f64| {
                let arm = nominal(to).r.transpose() * way(axis, to) * (side * REACH);
                (actual(to).r * arm).dot(&tool)
            };
            height(-1.0) - height(1.0)
        }
        (_, Sense::In(axis)) => tip.dot(&way(axis, to)),
        (_, Sense::About(axis)) => turn.dot(&way(axis, to)),
        (_, Sense::From(a, b)) => {
            assert_ne!(nature, Nature::Constant);
            turn.dot(&way(a, to).cross(&way(b, to)))
        }
    }
}

#[test]
fn every_figure_of_the_page_is_what_explain_says_and_the_exact_model_shows() {
    let rows = rows();
    let mut count = 0;
    for row in &rows {
        for (name, written) in &row.written {
            let machine = machine(&format!("examples/{name}.toml"));
            let (parameter, value) = written.split_once(" = ").unwrap();
            let parameter = Parameter::parse(parameter).unwrap();
            let mut errors = ErrorModel::perfect(&machine);
            assert!(errors.set(&machine, parameter, value.parse().unwrap()));
            let all = explain(&machine, &errors);
            let (sentence, reading) = (all[0].sentence(), all[0].reading.unwrap());
            let shown = format!("{:+.1} {}", row.shows, row.unit);
            let expected = row.done.replace('…', &shown);
            assert_eq!(
                sentence.split_once(": ").unwrap().1,
                expected,
                "{name}: {sentence}"
            );
            assert!(sentence.starts_with(written), "{name}: {sentence}");
            let factor = if row.unit == "µm" { 1e3 } else { 1e6 };
            let found = exact(&machine, &errors, all[0].alone.nature(), &reading) * factor;
            // Shown to one decimal.
            assert!(
                (found - row.shows).abs() < 0.051,
                "{name}: {sentence}: {found}"
            );
            assert!(
                (found - reading.value * factor).abs() < 1e-3,
                "{name}: {sentence}: {found}"
            );
            count += 1;
        }
    }
    assert!(
        rows.len() >= 20 && count >= 40,
        "{} rows, {count} figures",
        rows.len()
    );
}
