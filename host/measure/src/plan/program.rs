//! Writes a strategy as a program for a controller.

use super::candidates::{RUN_UP, Setup};
use super::touches::{PER_BALL, Touching, Unreachable};
use crate::formats::probings::{Probing, Probings};
use std::fmt::Write;
use trueaxis_model::machine::{Machine, PerAxis};

/// Feed rates (mm/min).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Feeds {
    /// Touching.
    pub touch: f64,
    /// Near the ball.
    pub near: f64,
}

/// A row that cannot be touched, with the reason.
pub type NotTouched = Box<(Probing, Unreachable)>;

/// All touches of a strategy, row by row.
fn touchings(setup: &Setup<'_>, strategy: &Probings) -> Result<Vec<Touching>, NotTouched> {
    let setup = Setup {
        balls: strategy.balls.clone(),
        ..setup.clone()
    };
    let rows = strategy.rows.iter();
    rows.map(|row| setup.touching(row).map_err(|e| Box::new((row.clone(), e))))
        .collect()
}

/// Program words of some axes.
fn words(machine: &Machine, position: &PerAxis, is_in: impl Fn(usize) -> bool) -> String {
    // X Y Z A B C U V W, the usual order.
    let in_order = "XYZABCUVW"
        .chars()
        .filter_map(|letter| machine.index(letter));
    let words = in_order.filter(|i| is_in(*i)).map(|i| {
        let letter = machine.axes[i].letter;
        format!(" {letter}{:.4}", unsigned(position[i]))
    });
    words.collect()
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
    strategy: &Probings,
    feeds: Feeds,
    log: &str,
) -> Result<String, NotTouched> {
    let machine = setup.machine;
    let touchings = touchings(setup, strategy)?;
    let is_rotary = |i: usize| machine.axes[i].letter.is_rotary();
    let is_linear = |i: usize| !is_rotary(i);
    let zeros = words(machine, &PerAxis::default(), |_| true);
    let Feeds { touch, near } = feeds;
    let mut text = format!(
        "(trueaxis plan: {} probings of {} on {}, {PER_BALL} touches each)\n\
         (Machine coordinates: sets G59.3 to zero, takes the tool length and G92 off.)\n\
         (Start it with the stylus clear of everything; it knows neither fixtures nor table.)\n\
         G21 G90 G94 G17 G40 G49 G80\n\
         G92.2\n\
         G10 L2 P9 R0{}\n\
         G59.3\n\
         #<touch> = {touch}\n\
         #<near> = {near}\n\
         (PROBEOPEN {log})\n",
        strategy.rows.len(),
        plural(strategy.balls.len()),
        plain(&machine.name),
        zeros.replace(".0000", ""),
    );
    let mut last: Option<PerAxis> = None;
    let mut came = PerAxis::default();
    let mut turned = None;
    for (row, touching) in strategy.rows.iter().zip(&touchings) {
        let Touching { away, above, .. } = touching;
        let _ = writeln!(
            text,
            "(row {}: ball {},{})",
            row.line,
            plain(&strategy.balls[row.ball]),
            words(machine, away, is_rotary)
        );
        if last.is_none() {
            // First move away from the table, wherever the program starts.
            let up = |i: usize| is_linear(i) && (away[i] - above[i]).abs() > 1e-6;
            let _ = writeln!(text, "G0{}", words(machine, away, up));
        }
        let start = |i: usize| away[i] - row.direction[i] * RUN_UP;
        let needs = |i: usize| {
            let stays = last.is_some_and(|last| (last[i] - away[i]).abs() < 1e-6);
            let comes = match last {
                Some(last) if !stays => (away[i] - last[i]).signum(),
                _ => came[i],
            };
            is_rotary(i) && row.direction[i] != 0.0 && comes != row.direction[i]
        };
        if (0..machine.axes.len()).any(needs) {
            let first: PerAxis = std::array::from_fn(|i| {
                if i < machine.axes.len() {
                    start(i)
                } else {
                    0.0
                }
            });
            let _ = writeln!(text, "G0{}", words(machine, &first, needs));
        }
        if (0..machine.axes.len()).any(is_rotary) {
            let _ = writeln!(text, "G0{}", words(machine, away, is_rotary));
        }
        for i in (0..machine.axes.len()).filter(|i| row.direction[*i] != 0.0) {
            came[i] = row.direction[i];
        }
        let spindle = row.spindle.rem_euclid(360.0);
        if strategy.rows.iter().any(|r| r.spindle != 0.0) && turned != Some(spindle) {
            let _ = writeln!(text, "M19 R{spindle} Q30");
            turned = Some(spindle);
        }
        let _ = writeln!(text, "G0{}", words(machine, away, is_linear));
        let mut to = |code: &str, position: &PerAxis, feed: &str| {
            let _ = writeln!(
                text,
                "{code}{} F#<{feed}>",
                words(machine, position, is_linear)
            );
        };
        to("G1", above, "near");
        for (number, touch) in touching.touches.iter().enumerate() {
            if number > 0 {
                to("G1", &touch.over, "near");
                to("G1", &touch.begin, "near");
            }
            to("G38.2", &touch.end, "touch");
            to("G1", &touch.begin, "near");
            if number > 0 {
                to("G1", &touch.over, "near");
            }
        }
        to("G1", above, "near");
        let _ = writeln!(text, "G0{}", words(machine, away, is_linear));
        last = Some(*away);
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

/// The same as a table (CSV, mm and degrees), one line per touch: rotary axes and spindle; linear axes with the
/// stylus at the ball centre, at the start of the touch, and at its end if nothing is touched.
///
/// # Errors
/// The first row that cannot be touched.
pub fn table(setup: &Setup<'_>, strategy: &Probings) -> Result<String, NotTouched> {
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
    for (row, touching) in strategy.rows.iter().zip(touchings(setup, strategy)?) {
        for (number, touch) in touching.touches.iter().enumerate() {
            let name = &strategy.balls[row.ball];
            let mut cells = vec![row.line.to_string(), name.clone(), (number + 1).to_string()];
            cells.extend(rotary.iter().map(|(i, _)| row.position[*i].to_string()));
            cells.push(row.spindle.to_string());
            for position in [&touching.centre, &touch.begin, &touch.end] {
                let numbers = linear
                    .iter()
                    .map(|(i, _)| format!("{:.4}", unsigned(position[*i])));
                cells.extend(numbers);
            }
            text += &(cells.join(",") + "\n");
        }
    }
    Ok(text)
}
