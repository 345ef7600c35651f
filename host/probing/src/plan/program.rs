//! Writes a plan as a program for a controller.

use super::candidates::Setup;
use super::step::{AxisTargets, ProbingStep};
use super::steps::{NotTouched, steps, target, touchings};
use std::fmt::Write;
use trueaxis_identify::formats::probings::Probings;
use trueaxis_model::machine::{Machine, PerAxis};

/// Feed rates (mm/min).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Feeds {
    /// Touching.
    pub touch: f64,
    /// Near the ball.
    pub near: f64,
}

/// Program words.
fn words(machine: &Machine, target: &AxisTargets) -> String {
    let word = |(i, position): &(usize, f64)| {
        let letter = machine.axes[*i].letter;
        format!(" {letter}{:.4}", unsigned(*position))
    };
    target.iter().map(word).collect()
}

/// Zero without a sign.
fn unsigned(value: f64) -> f64 {
    if value.abs() < 5e-5 { 0.0 } else { value }
}

/// A program for LinuxCNC: five touches for each row (`G38.2`), whose machine positions are written to `log`
/// (`PROBEOPEN`), one line each.
///
/// It works in machine coordinates: it sets the coordinate system G59.3 to zero and cancels the tool length, because
/// LinuxCNC logs the displayed position.
///
/// # Errors
/// The first row that cannot be touched.
pub fn linuxcnc(
    setup: &Setup<'_>,
    plan: &Probings,
    feeds: Feeds,
    log: &str,
) -> Result<String, NotTouched> {
    let machine = setup.machine;
    let steps = steps(setup, plan)?;
    let all = |position: &PerAxis| target(machine, position, |_| true);
    let is_rotary = |(i, _): &(usize, f64)| machine.axes[*i].letter.is_rotary();
    let zeros = words(machine, &all(&PerAxis::default()));
    let Feeds { touch, near } = feeds;
    let mut text = format!(
        "(trueaxis plan: {} probings of {} on {}, {} touches each)\n\
         (Machine coordinates: sets G59.3 to zero, takes the tool length and G92 off.)\n\
         (Start it with the stylus clear of everything; it knows neither fixtures nor table.)\n\
         G21 G90 G94 G17 G40 G49 G80\n\
         G92.2\n\
         G10 L2 P9 R0{}\n\
         G59.3\n\
         #<touch> = {touch}\n\
         #<near> = {near}\n\
         (PROBEOPEN {log})\n",
        plan.rows.len(),
        plural(plan.balls.len()),
        plain(&machine.name),
        setup.probe.per_ball(),
        zeros.replace(".0000", ""),
    );
    let words = |target: &AxisTargets| words(machine, target);
    for step in &steps {
        let _ = match step {
            ProbingStep::Row(number) => {
                let row = &plan.rows[*number];
                let ball = plain(&plan.balls[row.ball]);
                let rotary: AxisTargets =
                    all(&row.position).into_iter().filter(is_rotary).collect();
                writeln!(text, "(row {}: ball {ball},{})", row.line, words(&rotary))
            }
            ProbingStep::Orient(angle) => writeln!(text, "M19 R{angle} Q30"),
            ProbingStep::Rapid(to) => writeln!(text, "G0{}", words(to)),
            ProbingStep::Near(to) => writeln!(text, "G1{} F#<near>", words(to)),
            ProbingStep::Touch { end, .. } => writeln!(text, "G38.2{} F#<touch>", words(end)),
        };
    }
    text += "(PROBECLOSE)\nM2\n";
    Ok(text)
}

/// Removes characters that are not allowed in a comment.
fn plain(name: &str) -> String {
    let is_plain = |c: char| c.is_ascii() && !c.is_ascii_control() && !"()".contains(c);
    name.chars()
        .map(|c| if is_plain(c) { c } else { '_' })
        .collect()
}

fn plural(balls: usize) -> String {
    format!("{balls} ball{}", if balls == 1 { "" } else { "s" })
}

/// The touches as a table (CSV, mm and degrees), one line per touch: rotary axes and spindle; linear axes with the
/// stylus at the ball centre, at the start of the touch, and at its end if nothing is touched.
///
/// # Errors
/// The first row that cannot be touched.
pub fn table(setup: &Setup<'_>, plan: &Probings) -> Result<String, NotTouched> {
    let axes = &setup.machine.axes;
    let letters = |rotary: bool| {
        let of = axes.iter().enumerate();
        of.filter(move |(_, a)| a.letter.is_rotary() == rotary)
            .map(|(i, a)| (i, a.letter.to_string()))
            .collect::<Vec<_>>()
    };
    let (rotary, linear) = (letters(true), letters(false));
    let mut header = vec!["row".to_owned(), "ball".to_owned(), "touch".to_owned()];
    header.extend(rotary.iter().map(|(_, l)| l.clone()));
    header.push("S".to_owned());
    for what in ["centre", "begin", "end"] {
        header.extend(linear.iter().map(|(_, l)| format!("{l}_{what}")));
    }
    let mut text = header.join(",") + "\n";
    for (row, touching) in plan.rows.iter().zip(touchings(setup, plan)?) {
        for (number, touch) in touching.touches.iter().enumerate() {
            let name = &plan.balls[row.ball];
            let mut cells = vec![row.line.to_string(), name.clone(), (number + 1).to_string()];
            cells.extend(rotary.iter().map(|(i, _)| row.position[*i].to_string()));
            cells.push(row.spindle.to_string());
            for position in [&touching.centre, &touch.begin, &touch.end] {
                let numbers =
                    (linear.iter()).map(|(i, _)| format!("{:.4}", unsigned(position[*i])));
                cells.extend(numbers);
            }
            text += &(cells.join(",") + "\n");
        }
    }
    Ok(text)
}
