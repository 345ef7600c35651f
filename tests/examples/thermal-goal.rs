//! Prints how much drift of a machine with finite-difference temperature fields is left in duty cycles that nobody has
//! measured: `cargo run --release -p trueaxis-tests --example thermal-goal [SEEDS] [FOLDER]`. With a folder, it also
//! writes the files of the first seed, for `trueaxis identify`.

use std::path::Path;
use trueaxis_tests::thermal_goal::{machine, measured, reached};

fn main() -> std::io::Result<()> {
    let mut arguments = std::env::args().skip(1);
    let seeds = arguments.next().and_then(|n| n.parse().ok()).unwrap_or(5);
    if let Some(folder) = arguments.next() {
        let files = measured(&machine(), 2.0, 300.0, 1);
        let folder = Path::new(&folder);
        std::fs::write(folder.join("machine.toml"), files.machine)?;
        std::fs::write(folder.join("points.csv"), files.points)?;
        std::fs::write(folder.join("temperatures.csv"), files.temperatures)?;
    }
    for seed in 1..=seeds {
        let found = reached(2.0, 300.0, 20, seed);
        println!(
            "{} h of data, {} cycles; sensors: {}",
            found.hours,
            found.cycles,
            found.sensors.join(", ")
        );
        println!(
            "  20 unseen duty cycles: {:.2} µm rms, at most {:.2} µm, without temperatures; {:.2} and {:.2} µm with them",
            found.without.rms, found.without.most, found.with.rms, found.with.most
        );
        println!(
            "  {:.1} % less drift, in the worst cycle {:.1} %; the stated band of ± {:.2} µm covers {:.1} %",
            100.0 * (1.0 - found.with.rms / found.without.rms),
            100.0 * (1.0 - found.worst),
            found.band,
            100.0 * found.covered
        );
        if seed == 1 {
            for input in &found.warmed.model.inputs {
                println!("  {} range {:?}", input.name(), input.range_kelvin);
            }
            println!(
                "{:?}\n{:?}\n{}",
                found.warmed.taken, found.warmed.dropped, found.errors
            );
        }
    }
    Ok(())
}
