//! `cargo xtask arena`.

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::{env, fs};
use trueaxis_arena::{
    MACHINES, ROUND, Scored, baselines, differences, export, page, score, tables, write,
};

const USAGE: &str = "\
usage: arena [COUNT] [--seed N] [--page FOLDER | --check FOLDER | --export FOLDER | --score FOLDER]

  COUNT            how many machines (200), the classes in turn
  --seed N         another round than the published one
  --page FOLDER    writes the page and the scores of the baselines there: arena-scores.md, arena-scores.csv
  --check FOLDER   compares the scores of the baselines with those
  --export FOLDER  writes what is public of the machines into a new folder
  --score FOLDER   scores a submission beside `none`";

/// What is to be done.
enum Job {
    Show,
    Page(PathBuf),
    Check(PathBuf),
    Export(PathBuf),
    Score(PathBuf),
}

/// The command line.
struct Arguments {
    count: usize,
    seed: u64,
    job: Job,
}

const PAGE: &str = "arena-scores.md";
const SCORES: &str = "arena-scores.csv";

fn arguments() -> Option<Arguments> {
    let mut arguments = Arguments {
        count: MACHINES,
        seed: ROUND,
        job: Job::Show,
    };
    let mut words = env::args().skip(1);
    while let Some(word) = words.next() {
        let mut folder = || words.next().map(PathBuf::from);
        match word.as_str() {
            "--seed" => arguments.seed = words.next()?.parse().ok()?,
            "--page" => arguments.job = Job::Page(folder()?),
            "--check" => arguments.job = Job::Check(folder()?),
            "--export" => arguments.job = Job::Export(folder()?),
            "--score" => arguments.job = Job::Score(folder()?),
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
    match run(&arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("arena: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: &Arguments) -> Result<(), String> {
    let (seed, count) = (arguments.seed, arguments.count);
    match &arguments.job {
        Job::Show => print!("{}", tables(&scores(seed, count))),
        Job::Page(folder) => {
            let scores = scores(seed, count);
            for (name, text) in [(PAGE, page(&scores, seed)), (SCORES, write(&scores))] {
                let path = folder.join(name);
                fs::write(&path, text).map_err(|e| format!("{}: {e}", path.display()))?;
                println!("{}", path.display());
            }
        }
        Job::Check(folder) => {
            let path = folder.join(SCORES);
            let published =
                fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))?;
            let scores = scores(seed, count);
            let different = differences(&scores, &published);
            if !different.is_empty() {
                let remedy = "write the page again with --page, and say why in the commit";
                return Err(format!("{}\n{remedy}", different.join("\n")));
            }
            println!("{} scores of {count} machines as published", scores.len());
        }
        Job::Export(folder) => {
            export(folder, seed, count).map_err(|e| format!("{}: {e}", folder.display()))?;
            println!("{}: {count} machines", folder.display());
        }
        Job::Score(folder) => {
            let scores = score(folder, seed, count).map_err(|refused| refused.to_string())?;
            print!("{}", tables(&scores));
        }
    }
    Ok(())
}

fn scores(seed: u64, count: usize) -> Vec<Scored> {
    let done = AtomicUsize::new(0);
    baselines(seed, count, |number| {
        let done = done.fetch_add(1, Ordering::Relaxed) + 1;
        eprintln!("{done}/{count}: machine {number}");
    })
}
