//! Circles in LinuxCNC on a machine with play: what its own `BACKLASH` leaves of the contour, and what the compensation
//! leaves that `setup` makes of it, in the same run. Both corrections of every period are recorded, and go to a model
//! of play.

use super::bench::LinuxCncBench;
use super::rows::RecordedRows;
use super::three_axes::ThreeAxes;
use programs::{csv, files};
use std::ops::Range;

const FOLDER: &str = "contour";
/// The machine's play on X and Y, mm.
const PLAY: f64 = 0.03;
/// Contour errors up to this (mm) are not counted.
const ALLOWED: f64 = 2e-3;
/// How much longer than with `BACKLASH` they may last.
const LONGER: f64 = 1.2;
/// A circle begins with the play made up; corrections of f32, mm.
const BEGINS: f64 = 1e-6;
/// Recorded of each of the two joints.
const OF_JOINT: [&str; 4] = [
    "joint.N.pos-cmd",
    "joint.N.motor-pos-cmd",
    "joint.N.motor-offset",
    "trueaxis.joint.N.correction",
];
/// Longer than all circles, in periods of a millisecond.
const MOST_ROWS: usize = 60_000;

/// # Errors
/// The violated condition.
pub fn check(bench: &LinuxCncBench) -> Result<(), String> {
    let machine = ThreeAxes {
        name: FOLDER,
        play: PLAY,
        home: None,
    };
    machine.set_up(bench)?;
    let [toml, errors, trax] =
        ["machine.toml", "errors.toml", "machine.trax"].map(|name| format!("{FOLDER}/new/{name}"));
    bench.compile(&toml, &errors, &trax, &[])?;
    // The results of an earlier run must not be used instead.
    for name in ["circles.csv", "record"] {
        let _ = std::fs::remove_file(bench.file(&format!("{FOLDER}/{name}")));
    }
    // BACKLASH stays, so that both act in every period; the component's command goes nowhere but to the drive.
    let said = machine.run(bench, &tape())?;
    let circles =
        files::read_text(&bench.file("contour/circles.csv")).map_err(|e| format!("{e}\n{said}"))?;
    let names: Vec<String> = ["0", "1"]
        .iter()
        .flat_map(|joint| OF_JOINT.map(|name| name.replace('N', joint)))
        .collect();
    let rows = RecordedRows::read(bench, "contour/record", &names)?;
    for circle in csv::numbers(&circles)? {
        let [feed, first, end] = circle[..] else {
            return Err(format!("a circle is {circle:?}"));
        };
        judge(&rows, feed, first as usize..end as usize)?;
    }
    Ok(())
}

/// One circle: how long and how far the contour is off, with LinuxCNC's correction and with ours.
fn judge(rows: &RecordedRows, feed: f64, range: Range<usize>) -> Result<(), String> {
    let (mut lasts, mut most) = ([0; 2], [0.0_f64; 2]);
    for joint in ["0", "1"] {
        let of = |name: &str| rows.of(&name.replace('N', joint))[range.clone()].to_vec();
        let [command, motor, offset, ours] = OF_JOINT.map(of);
        let periods = command.iter().zip(motor.iter().zip(&offset));
        let own: Vec<f64> = periods
            .map(|(q, (motor, offset))| motor - offset - q)
            .collect();
        let failed = |what: String| format!("F{feed}: joint {joint} {what}");
        reverses_twice(&own).map_err(failed)?;
        for (k, correction) in [&own, &ours].into_iter().enumerate() {
            let first = correction[0];
            if (first.abs() - 0.5 * PLAY).abs() > BEGINS {
                return Err(failed(format!("begins with a correction of {first}")));
            }
            let errors = with_play(&command, correction);
            lasts[k] += errors.iter().filter(|e| e.abs() > ALLOWED).count();
            most[k] = errors.iter().fold(most[k], |most, e| most.max(e.abs()));
        }
    }
    let [own, ours] = lasts;
    println!(
        "contour: R 30 mm at F{feed} with {:.0} µm of play: BACKLASH leaves up to {:.1} µm and more than {:.0} for \
         {own} ms, the compensation {:.1} µm and {ours} ms",
        PLAY * 1e3,
        most[0] * 1e3,
        ALLOWED * 1e3,
        most[1] * 1e3,
    );
    match ours as f64 <= LONGER * own as f64 {
        true => Ok(()),
        false => Err(format!("F{feed}: {ours} ms, with BACKLASH {own} ms")),
    }
}

/// On a circle a correction of play changes its sign twice.
fn reverses_twice(correction: &[f64]) -> Result<(), String> {
    let reverses = |w: &&[f64]| (w[0] > 0.0) != (w[1] > 0.0);
    match correction.windows(2).filter(reverses).count() {
        2 => Ok(()),
        count => Err(format!("reverses {count} times on a circle")),
    }
}

/// How far the carriage is from its command: it rests until the drive has gone through the play.
fn with_play(command: &[f64], correction: &[f64]) -> Vec<f64> {
    let mut carriage = command[0];
    let periods = command.iter().zip(correction);
    let errors = periods.map(|(command, correction)| {
        let drive = command + correction;
        carriage = carriage.clamp(drive - 0.5 * PLAY, drive + 0.5 * PLAY);
        carriage - command
    });
    errors.collect()
}

/// Records both joints after the component.
fn tape() -> String {
    let mut hal = format!(
        "loadrt tape record=/tmp/contour/record in={} rows={MOST_ROWS}\n",
        "f".repeat(2 * OF_JOINT.len())
    );
    let pins = [0, 1]
        .into_iter()
        .flat_map(|joint| OF_JOINT.map(|name| name.replace('N', &joint.to_string())));
    for (number, pin) in pins.enumerate() {
        // A pin may have its signal already.
        hal += &format!("net {} => tape.in-{number:02}\n", signal(&pin));
    }
    // The program switches the corrections: M64 P0 and M65 P0.
    hal + "addf tape.record servo-thread\nnet compensate motion.digital-out-00 => trueaxis.enable\n"
}

/// A signal with its writer, as `setup` calls it if it does.
fn signal(pin: &str) -> String {
    let parts: Vec<&str> = pin.split('.').collect();
    match parts[..] {
        ["joint", joint, name @ "pos-cmd"] => format!("trueaxis-{joint}-{name}"),
        ["joint", joint, "motor-pos-cmd"] => format!("trueaxis-{joint}-cmd"),
        _ => format!("{} {pin}", pin.replace('.', "-")),
    }
}
