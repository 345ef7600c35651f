//! `cargo xtask arena`.

use std::process::ExitCode;
use std::sync::atomic::{AtomicUsize, Ordering};
use trueaxis_arena::{MACHINES, ROUND, baselines, tables};

const USAGE: &str = "\
usage: arena [COUNT] [--seed N]

  COUNT     how many machines (200), the classes in turn
  --seed N  another round than the published one";

/// The command line.
struct Arguments {
    count: usize,
    seed: u64,
}

fn arguments() -> Option<Arguments> {
    let mut arguments = Arguments {
        count: MACHINES,
        seed: ROUND,
    };
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        match word.as_str() {
            "--seed" => arguments.seed = words.next()?.parse().ok()?,
            count => arguments.count = count.parse().ok()?,
        }
    }
    (arguments.count > 0).then_some(arguments)
}

fn main() -> ExitCode {
    let Some(arguments) = arguments() else {
        eprintln!("{USAGE}");
        return ExitCode::from(2);
    };
    let done = AtomicUsize::new(0);
    let scored = baselines(arguments.seed, arguments.count, |number| {
        let done = done.fetch_add(1, Ordering::Relaxed) + 1;
        eprintln!("{done}/{}: machine {number}", arguments.count);
    });
    print!("{}", tables(&scored));
    ExitCode::SUCCESS
}
