//! Prints how much drift of a machine with finite-difference temperature fields is left in duty cycles that nobody has
//! measured: `cargo run --release -p trueaxis-tests --example thermal-goal [SEEDS]`.
//!
//! `… thermal-goal --files FOLDER` writes the files of a measurement instead, for `trueaxis identify`.

use std::path::Path;
use trueaxis_tests::thermal_field::MACHINE;
use trueaxis_tests::thermal_goal::{Measurement, machine, measured, reached};

/// Unseen duty cycles for each seed.
const UNSEEN: u64 = 20;

fn main() -> std::io::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if let [option, folder] = &arguments[..]
        && option == "--files"
    {
        return write(Path::new(folder));
    }
    let seeds = arguments.first().and_then(|n| n.parse().ok()).unwrap_or(5);
    let mut is_reached = true;
    for seed in 1..=seeds {
        let measurement = Measurement {
            seed,
            ..Measurement::EIGHT_HOURS
        };
        let found = reached(&measurement, UNSEEN);
        let less = 1.0 - found.with.rms / found.without.rms;
        println!(
            "{} h of data in {} cycles, noise {seed}; {} sensors of 6: {}",
            found.hours,
            found.cycles,
            found.sensors.len(),
            found.sensors.join(", ")
        );
        println!(
            "  drift in {UNSEEN} other duty cycles: {:.2} µm rms, {:.1} µm at most; with the terms {:.2} and {:.1} µm",
            found.without.rms, found.without.most, found.with.rms, found.with.most
        );
        println!(
            "  {:.1} % less, {:.1} % less in the worst cycle; ± {:.2} µm stated, {:.1} % within",
            100.0 * less,
            100.0 * (1.0 - found.worst),
            found.band,
            100.0 * found.covered
        );
        is_reached &= found.sensors.len() <= 4 && less >= 0.8 && found.covered >= 0.95;
    }
    match is_reached {
        true => Ok(()),
        false => Err(std::io::Error::other(
            "not reached: 4 sensors, 80 % less, 95 % within",
        )),
    }
}

/// The files of the manual.
fn write(folder: &Path) -> std::io::Result<()> {
    let measurement = Measurement {
        every: 600.0,
        log: 60.0,
        ..Measurement::EIGHT_HOURS
    };
    let files = measured(&machine(), &measurement);
    std::fs::write(folder.join("machine.toml"), MACHINE.trim_start())?;
    std::fs::write(folder.join("points.csv"), files.points)?;
    std::fs::write(folder.join("temperatures.csv"), files.temperatures)
}
