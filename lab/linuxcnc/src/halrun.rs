//! The component without a motion controller: inputs are played and outputs recorded, exactly.

use super::bench::LinuxCncBench;
use super::oracle::eval;
use super::rows::{EventNumbers, RecordedRows, adds_up, play};
use std::fmt::Write;

/// Number of rows in a path.
const ROWS: usize = 2000;
/// Fraction of a path driven in a smooth case, to be as slow as a machine.
const PART: f64 = 0.02;
/// Pins recorded for each joint.
const OF_JOINT: [&str; 7] = [
    "pos-in",
    "motor-cmd-in",
    "motor-cmd-out",
    "motor-fb-in",
    "motor-fb-out",
    "correction",
    "computed",
];
/// The pins that are played.
const PLAYED: [&str; 3] = ["pos-in", "motor-cmd-in", "motor-fb-in"];
const INCH: f64 = 25.4;

/// A file for the component, and its load parameters.
struct HalCase {
    file: &'static str,
    /// Letters of the joints.
    joints: &'static str,
    units: &'static str,
    /// Travel of each joint, in its unit.
    travel: &'static [[f64; 2]],
    /// Further inputs: name in the file, pin, value (a changed value would be faded in), reference subtracted by the
    /// file.
    inputs: &'static [(&'static str, &'static str, f64, f64)],
    /// Whether corrections always equal the computed ones: no direction-dependent tables, and slow enough for the rate
    /// bounds.
    smooth: bool,
}

const HURON: &[[f64; 2]] = &[
    [-340.0, 340.0],
    [-340.0, 340.0],
    [-340.0, 340.0],
    [-110.0, 110.0],
    [-350.0, 350.0],
];

const CASES: [HalCase; 6] = [
    HalCase {
        file: "huron-13.trax",
        joints: "XYZAC",
        units: "mm",
        travel: HURON,
        inputs: &[],
        smooth: true,
    },
    HalCase {
        file: "huron-13.trax",
        joints: "XYZAC",
        units: "inch",
        travel: &[
            [-13.0, 13.0],
            [-13.0, 13.0],
            [-13.0, 13.0],
            [-110.0, 110.0],
            [-350.0, 350.0],
        ],
        inputs: &[],
        smooth: true,
    },
    HalCase {
        file: "router-10.trax",
        joints: "XYZ-",
        units: "metric",
        travel: &[[1.0, 799.0], [1.0, 1199.0], [-149.0, -1.0], [0.0, 9.0]],
        inputs: &[],
        smooth: false,
    },
    // A gantry: two joints on Y.
    HalCase {
        file: "router-10.trax",
        joints: "XYYZ",
        units: "mm",
        travel: &[[1.0, 799.0], [1.0, 1199.0], [1.0, 1199.0], [-149.0, -1.0]],
        inputs: &[],
        smooth: false,
    },
    // The table turns continuously.
    HalCase {
        file: "table-head-13.trax",
        joints: "XYZBC",
        units: "mm",
        travel: &[
            [-399.0, 399.0],
            [-299.0, 299.0],
            [1.0, 499.0],
            [-99.0, 99.0],
            [-9000.0, 9000.0],
        ],
        inputs: &[],
        smooth: false,
    },
    HalCase {
        file: "everything.trax",
        joints: "XYZC",
        units: "mm",
        travel: &[
            [-399.0, 399.0],
            [-249.0, 249.0],
            [-299.0, 299.0],
            [-9000.0, 9000.0],
        ],
        inputs: &[
            ("tool length", "tool-length", 187.25, 0.0),
            ("bed", "temperature-0", 27.5, 20.0),
        ],
        smooth: false,
    },
];

/// # Errors
/// The violated condition.
pub fn check(bench: &LinuxCncBench) -> Result<(), String> {
    for name in ["huron-13", "router-10", "table-head-13", "everything"] {
        bench.copy(
            &format!("tests/golden/v1/{name}.trax"),
            &format!("{name}.trax"),
        )?;
    }
    let mut compared = 0;
    for case in &CASES {
        compared += case.check(bench).map_err(|e| {
            format!(
                "{}, axes={}, units={}: {e}",
                case.file, case.joints, case.units
            )
        })?;
    }
    println!("halrun: {compared} corrections are those of `trueaxis eval`, to the last bit");
    Ok(())
}

impl HalCase {
    /// Load parameters of the component.
    fn load(&self) -> String {
        let temperatures = self.inputs.iter().filter(|i| i.1.starts_with('t')).count();
        format!(
            "loadrt trueaxis file=/tmp/{} axes={} units={} temperatures={temperatures}\n",
            self.file, self.joints, self.units
        )
    }

    fn check(&self, bench: &LinuxCncBench) -> Result<usize, String> {
        let joints = self.joints.len();
        let mut random = EventNumbers::new(1);
        let shapes: Vec<[f64; 2]> = (0..joints)
            .map(|_| [random.within(1.0, 3.0), random.within(0.0, 6.0)])
            .collect();
        let between = |k: usize, [low, high]: [f64; 2], row: usize| {
            let part = if self.smooth { PART } else { 1.0 };
            let time = part * std::f64::consts::TAU * row as f64 / ROWS as f64;
            let share = 0.5 + 0.5 * (shapes[k][0] * time + shapes[k][1]).sin();
            low + (high - low) * share
        };
        let rows: Vec<Vec<f64>> = (0..ROWS)
            .map(|row| {
                let mut values = Vec::new();
                for (k, travel) in self.travel.iter().enumerate() {
                    let same = self.joints[..k].find(&self.joints[k..=k]);
                    let position = between(same.unwrap_or(k), *travel, row);
                    let feedback = position + random.within(-1.0, 1.0);
                    values.extend([position, position + 3.25, feedback]);
                }
                values.extend(self.inputs.iter().map(|i| i.2));
                values
            })
            .collect();
        play(bench, "play", &rows)?;
        let said = bench.halrun(&self.lines())?;
        let names: Vec<String> = (0..joints)
            .flat_map(|j| OF_JOINT.map(|pin| format!("{j}.{pin}")))
            .chain(self.inputs.iter().map(|i| i.1.to_owned()))
            .collect();
        let recorded =
            RecordedRows::read(bench, "record", &names).map_err(|e| format!("{e}\n{said}"))?;
        if recorded.len() < ROWS {
            return Err(format!("{} rows were recorded\n{said}", recorded.len()));
        }
        self.corrections_are_those_of_eval(bench, &recorded)?;
        self.outputs_add_up(&recorded)?;
        Ok(recorded.len() * joints)
    }

    /// Plays and records with corrections fully in.
    fn lines(&self) -> String {
        let joints = self.joints.len();
        let played = joints * PLAYED.len() + self.inputs.len();
        let recorded = joints * OF_JOINT.len() + self.inputs.len();
        let mut hal = format!(
            "loadrt threads name1=t period1=200000\n{}loadrt tape play=/tmp/play out={} record=/tmp/record in={} \
             rows={}\n",
            self.load(),
            "f".repeat(played),
            "f".repeat(recorded),
            2 * ROWS
        );
        for function in [
            "tape.play",
            "trueaxis.read",
            "trueaxis.write",
            "tape.record",
        ] {
            let _ = writeln!(hal, "addf {function} t");
        }
        hal += &self.connections();
        hal + "start\nsetp trueaxis.enable 1\nloadusr -w sh /tmp/until trueaxis.factor 1\n\
               setp tape.keep 1\nsetp tape.run 1\nloadusr -w sh /tmp/until tape.done TRUE\n"
    }

    /// Connects the pins with the tape.
    fn connections(&self) -> String {
        let mut hal = String::new();
        let (mut from, mut to) = (0, 0);
        for j in 0..self.joints.len() {
            for pin in OF_JOINT {
                if PLAYED.contains(&pin) {
                    let _ = writeln!(hal, "net {j}-{pin} tape.out-{from:02}");
                    from += 1;
                }
                let _ = writeln!(
                    hal,
                    "net {j}-{pin} trueaxis.joint.{j}.{pin} tape.in-{to:02}"
                );
                to += 1;
            }
            let _ = writeln!(hal, "setp trueaxis.joint.{j}.homed 1");
        }
        for (_, pin, ..) in self.inputs {
            let _ = writeln!(
                hal,
                "net {pin} tape.out-{from:02} trueaxis.{pin} tape.in-{to:02}"
            );
            (from, to) = (from + 1, to + 1);
        }
        hal
    }

    /// Converts a number to the unit of the file.
    fn unit(&self, joint: usize) -> f64 {
        let rotary = "ABC".contains(&self.joints[joint..=joint]);
        if self.units == "inch" && !rotary {
            INCH
        } else {
            1.0
        }
    }

    /// The first joint of each axis.
    fn first_joints(&self) -> Vec<usize> {
        let joints = self.joints.char_indices();
        let firsts =
            joints.filter(|(j, letter)| *letter != '-' && self.joints.find(*letter) == Some(*j));
        firsts.map(|(j, _)| j).collect()
    }

    /// Recorded positions in the units of the file, of the first joints and of further inputs.
    fn positions(&self, firsts: &[usize], recorded: &RecordedRows) -> Vec<Vec<f64>> {
        let mut positions = vec![Vec::new(); recorded.len()];
        for &j in firsts {
            let column = recorded.of(&format!("{j}.pos-in"));
            for (row, value) in positions.iter_mut().zip(column) {
                // Within one turn, as in the component before the conversion to float.
                let endless = self.travel[j][1] > 360.0 && "ABC".contains(&self.joints[j..=j]);
                let value = if endless { value % 360.0 } else { value };
                row.push(value * self.unit(j));
            }
        }
        for (_, pin, _, reference) in self.inputs {
            for (row, value) in positions.iter_mut().zip(recorded.of(pin)) {
                row.push(value - reference);
            }
        }
        positions
    }

    fn corrections_are_those_of_eval(
        &self,
        bench: &LinuxCncBench,
        recorded: &RecordedRows,
    ) -> Result<(), String> {
        let firsts = self.first_joints();
        let mut columns: Vec<&str> = firsts.iter().map(|&j| &self.joints[j..=j]).collect();
        columns.extend(self.inputs.iter().map(|i| i.0));
        let positions = self.positions(&firsts, recorded);
        let expected = eval(bench, self.file, &columns, firsts.len(), &positions)?;
        for j in 0..self.joints.len() {
            let letter = &self.joints[j..=j];
            let axis = columns[..firsts.len()].iter().position(|c| *c == letter);
            let right = |row: usize| {
                axis.map_or(0.0, |k| f64::from(expected[row][k]) * (1.0 / self.unit(j)))
            };
            // `computed` is from the last period in which it was this joint's turn.
            let computed = recorded.of(&format!("{j}.computed"));
            let turns = self.joints.len();
            let in_turn = |phase: usize| {
                let mut rows = computed.iter().enumerate().skip(turns);
                rows.all(|(row, found)| same(*found, right(row - (row + phase) % turns)))
            };
            if !(0..turns).any(in_turn) {
                return Err(format!("joint {j}: what is computed is not what eval says"));
            }
            let corrections = recorded.of(&format!("{j}.correction"));
            let mut wrong = corrections.iter().enumerate();
            let wrong = wrong.find(|(row, found)| self.smooth && !same(**found, right(*row)));
            if let Some((row, found)) = wrong {
                return Err(format!(
                    "row {row}, joint {j}: correction {found:?}, eval {:?} at {:?}",
                    right(row),
                    positions[row]
                ));
            }
        }
        Ok(())
    }

    /// The command includes the correction of this period, and that of the last period is removed from the feedback.
    fn outputs_add_up(&self, recorded: &RecordedRows) -> Result<(), String> {
        for j in 0..self.joints.len() {
            let of = |pin: &str| recorded.of(&format!("{j}.{pin}"));
            let correction = of("correction");
            let (cmd_in, cmd_out) = (of("motor-cmd-in"), of("motor-cmd-out"));
            let (fb_in, fb_out) = (of("motor-fb-in"), of("motor-fb-out"));
            adds_up(j, &correction, [&cmd_in, &cmd_out], [&fb_in[1..], &fb_out])?;
            if self.joints[j..=j] == *"-" {
                if correction.iter().any(|c| *c != 0.0) {
                    return Err(format!("joint {j} is corrected, but is not to be"));
                }
            } else if correction.iter().all(|c| *c == 0.0) {
                return Err(format!("joint {j} is never corrected"));
            }
        }
        Ok(())
    }
}

/// Equal bits, or both 0.
fn same(found: f64, right: f64) -> bool {
    found.to_bits() == right.to_bits() || (found == 0.0 && right == 0.0)
}
