//! The scheme `exact` on randomly generated machines: `cargo xtask random-machines`.

use std::path::Path;
use std::process::ExitCode;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use trueaxis_tests::best_effort::is_finer_missed;
use trueaxis_tests::random_machines::{ALL, Case, Counts, Effort, Judged, case, cases, unmeasured};

const USAGE: &str = "\
usage: random-machines [COUNT] [--tolerance T] [--quick] [--unmeasured] [--best-effort] [--seed N] [--files FOLDER]

  COUNT          how many drawings (300)
  --tolerance T  µm and µrad (1); a finer and a coarser one are tried, too
  --quick        without the finer tolerance and without the stm32f405
  --unmeasured   only drawings without measured motions
  --best-effort  with a small target only: a finer tolerance leaves no more than a coarser one
  --seed N       only this drawing, with its files
  --files FOLDER write their files to FOLDER, as machine-N.toml and errors-N.toml, and do nothing else";

struct Arguments {
    count: usize,
    tolerance: f64,
    quick: bool,
    unmeasured: bool,
    best_effort: bool,
    seed: Option<u64>,
    files: Option<String>,
}

fn arguments() -> Option<Arguments> {
    let mut arguments = Arguments {
        count: ALL,
        tolerance: 1.0,
        quick: false,
        unmeasured: false,
        best_effort: false,
        seed: None,
        files: None,
    };
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        match word.as_str() {
            "--tolerance" => arguments.tolerance = words.next()?.parse().ok()?,
            "--quick" => arguments.quick = true,
            "--unmeasured" => arguments.unmeasured = true,
            "--best-effort" => arguments.best_effort = true,
            "--seed" => arguments.seed = Some(words.next()?.parse().ok()?),
            "--files" => arguments.files = Some(words.next()?),
            count => arguments.count = count.parse().ok()?,
        }
    }
    (arguments.tolerance > 0.0 && arguments.count > 0).then_some(arguments)
}

/// Panics if a finer tolerance leaves larger errors than a coarser one.
fn best_effort(cases: &[Case]) -> ExitCode {
    let mut missed = 0;
    for (number, case) in (1..).zip(cases) {
        let name = format!("machine {}", case.seed);
        let is_missed = is_finer_missed(&name, &case.machine, &case.errors);
        missed += u32::from(is_missed);
        let word = if is_missed { "missed" } else { "met" };
        println!(
            "{number}/{} {name}: the finer tolerance is {word}",
            cases.len()
        );
    }
    println!("{missed} miss the finer tolerance; none leaves more than with the coarser one");
    ExitCode::SUCCESS
}

/// Writes the files of the drawings to an existing folder.
fn write(cases: &[Case], folder: &Path) -> std::io::Result<()> {
    for Case { seed, files, .. } in cases {
        for (name, text) in ["machine", "errors"].iter().zip(files) {
            std::fs::write(folder.join(format!("{name}-{seed}.toml")), text)?;
        }
    }
    Ok(())
}

/// Judges all machines, several at a time.
fn judged(cases: &[Case], arguments: &Arguments) -> Vec<Judged> {
    let judged = Mutex::new(Vec::new());
    let next = AtomicUsize::new(0);
    let one_after_another = || {
        loop {
            let number = next.fetch_add(1, Ordering::Relaxed);
            let Some(case) = cases.get(number) else {
                break;
            };
            let effort = Effort {
                finest: !arguments.quick,
                board: !arguments.quick,
            };
            let new = Judged::new(case, arguments.tolerance, effort);
            let mut judged = judged.lock().expect("nobody panics with the lock");
            println!("{:>3}/{} {new}", judged.len() + 1, cases.len());
            judged.push(new);
        }
    };
    // Not with rayon, which the scheme itself uses: it would start one machine in the middle of another, and the times
    // would be meaningless.
    thread::scope(|scope| {
        for _ in 0..thread::available_parallelism().map_or(1, usize::from) {
            scope.spawn(one_after_another);
        }
    });
    let mut judged = judged.into_inner().expect("nobody panics with the lock");
    judged.sort_by_key(|j| j.seed);
    judged
}

fn main() -> ExitCode {
    let Some(arguments) = arguments() else {
        eprintln!("{USAGE}");
        return ExitCode::from(2);
    };
    let cases = match arguments.seed {
        None if arguments.unmeasured => unmeasured(arguments.count),
        None => cases(arguments.count),
        Some(seed) => case(seed).into_iter().collect(),
    };
    if let Some(folder) = arguments.files {
        return match write(&cases, Path::new(&folder)) {
            Ok(()) => ExitCode::SUCCESS,
            Err(error) => {
                eprintln!("{folder}: {error}");
                ExitCode::FAILURE
            }
        };
    }
    if arguments.seed.is_some() {
        for [machine, errors] in cases.iter().map(|c| &c.files) {
            println!("{machine}\n{errors}");
        }
    }
    if arguments.best_effort {
        return best_effort(&cases);
    }
    println!(
        "what was reached of each tolerance (µm, µrad), with tables/terms and the time it took"
    );
    let judged = judged(&cases, &arguments);
    let counts = Counts::of(&judged, arguments.tolerance);
    println!("\n{counts}");
    for wrong in judged.iter().filter(|j| !j.marks().is_empty()) {
        println!("{wrong}");
    }
    let shortfalls = counts.shortfalls();
    for shortfall in &shortfalls {
        eprintln!("{shortfall}");
    }
    match shortfalls.is_empty() {
        true => ExitCode::SUCCESS,
        false => ExitCode::FAILURE,
    }
}
