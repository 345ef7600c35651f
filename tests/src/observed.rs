//! Observations of every kind on a machine with known errors.

use crate::Fixed;
use std::fmt::Write;
use trueaxis_identify::formats::observations::{self, Observations};
use trueaxis_identify::simulate::{self, OfObservations};
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::machine::Machine;

/// Rows of a file of observations of a machine.
#[derive(Clone, Debug)]
pub struct Strategy<'a> {
    machine: &'a Machine,
    heading: String,
    rows: Vec<String>,
}

impl<'a> Strategy<'a> {
    /// With lines that begin with `#`.
    #[must_use]
    pub fn new(machine: &'a Machine, heading: &str) -> Self {
        Self {
            machine,
            heading: heading.to_owned(),
            rows: Vec::new(),
        }
    }

    /// Adds a row: positions (mm, deg), direction of the reading (of a surface its normal: `0 0 1`), standard uncertainty
    /// (µm, µrad).
    pub fn add(&mut self, kind: &str, setup: &str, position: &[f64], reads: &str, sigma: f64) {
        let position: Vec<String> = position.iter().map(|q| format!("{q:.6}")).collect();
        let readings = match kind {
            "length" => "0,,,,,,",
            "point" => ",0,0,0,,,",
            "displacement" => ",,,,0,,",
            "angle" => ",,,,,0,",
            _ => ",,,,,,0",
        };
        let reads = match kind {
            "surface" => format!(",{}", reads.replace(' ', ",")),
            _ => format!("{reads},,,"),
        };
        let sigmas = match kind {
            "angle" => format!(",{sigma}"),
            _ => format!("{sigma},"),
        };
        let (position, time) = (position.join(","), 30 * self.rows.len());
        self.rows.push(format!(
            "{kind},{setup},{position},{reads},{readings},{sigmas},{time}"
        ));
    }

    /// A random position in a part of the travel around its middle (mm, deg).
    pub fn anywhere(&self, part: f64, random: &mut Fixed) -> Vec<f64> {
        let axes = self.machine.axes.iter();
        axes.map(|axis| {
            let [low, high] = axis.travel;
            let half = 0.5 * part * (high - low);
            0.5 * (low + high) + random.within(-half, half)
        })
        .collect()
    }

    /// The file.
    #[must_use]
    pub fn text(&self) -> String {
        let axes = self.machine.axes.iter().map(|a| a.letter.to_string());
        let axes = axes.collect::<Vec<_>>().join(",");
        let mut text = format!(
            "{}kind,setup,{axes},reads,normal_x,normal_y,normal_z,length_mm,x_mm,y_mm,z_mm,displacement_um,angle_urad,deviation_um,sigma_um,sigma_urad,time_s\n",
            self.heading
        );
        for row in &self.rows {
            let _ = writeln!(text, "{row}");
        }
        text
    }

    /// Like `text`, as read.
    ///
    /// # Panics
    /// If it cannot be read.
    #[must_use]
    pub fn read(&self) -> Observations {
        let read = observations::read(&self.text(), "mixed.csv", self.machine);
        read.unwrap_or_else(|e| panic!("{} ({}): {}", e.message, e.remedy, self.text()))
    }
}

/// All kinds on a machine with the axes X, Y, Z, A and C, with its lengths and points from a table of 260 mm:
/// `parts` says which.
#[must_use]
pub fn mixed<'a>(machine: &'a Machine, parts: &[&str], random: &mut Fixed) -> Strategy<'a> {
    let mut plan = Strategy::new(machine, "");
    let has = |name: &str| parts.contains(&name);
    let tracker = if has("point") { 40 } else { 0 };
    let bar = if has("length") { 60 } else { 0 };
    for (kind, setup, count, sigma) in [
        ("length", "bar", bar, 0.5),
        ("point", "tracker", tracker, 2.0),
    ] {
        for _ in 0..count {
            let position = plan.anywhere(0.9, random);
            plan.add(kind, setup, &position, "", sigma);
        }
    }
    let index = |letter: char| machine.index(letter).expect("such an axis");
    let home = plan.anywhere(0.0, random);
    let mut line = |kind: &str, setup: &str, moved: char, reads: &str, sigma: f64| {
        let [low, high] = machine.axes[index(moved)].travel;
        for k in 0..21 {
            let mut position = home.clone();
            position[index(moved)] = low + (high - low) * f64::from(k) / 20.0;
            plan.add(kind, setup, &position, reads, sigma);
        }
    };
    if has("displacement") {
        line("displacement", "laser", 'X', "tool +X", 0.3);
        line("displacement", "edge", 'X', "tool +Z", 0.3);
        line("displacement", "square", 'X', "tool +Y", 0.3);
        line("displacement", "square", 'Y', "tool +X", 0.3);
    }
    if has("angle") {
        line("angle", "level", 'Y', "tool +Y to +Z", 0.5);
        line("angle", "calibrator", 'C', "tool +C", 2.0);
    }
    if has("surface") {
        let normals = ["1 0 0", "-1 0 0", "0 1 0", "0 -1 0", "0 0 1", "0.6 0 0.8"];
        for k in 0..60 {
            let position = plan.anywhere(0.9, random);
            plan.add(
                "surface",
                "part",
                &position,
                normals[k % normals.len()],
                1.0,
            );
        }
    }
    plan
}

/// The readings on a machine with errors, and noise as stated, of instruments that are where the lines with `#` of
/// `setups` put them. The result does not say where.
#[must_use]
pub fn observed(
    machine: &Machine,
    errors: &ErrorModel,
    plan: &Strategy<'_>,
    setups: &str,
    noise: f64,
    seed: u64,
) -> Observations {
    let own = setups.split("# [setup.").skip(1).filter(|entry| {
        let name = entry.split(']').next().unwrap_or_default();
        let mut rows = plan.rows.iter();
        rows.any(|row| row.split(',').nth(1) == Some(name))
    });
    let true_ones = Strategy {
        heading: own.map(|entry| format!("# [setup.{entry}")).collect(),
        ..plan.clone()
    };
    let disturbances = OfObservations {
        noise,
        seed,
        ..OfObservations::default()
    };
    let kinematics = Kinematics::new(machine, errors);
    let mut all = simulate::observations(&kinematics, &true_ones.read(), &disturbances);
    // Nothing is known about the set-ups.
    let read = plan.read();
    (all.setups, all.tools) = (read.setups, read.tools);
    all
}
