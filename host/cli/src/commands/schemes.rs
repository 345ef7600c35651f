//! `trueaxis schemes`

mod shown;

use super::Outcome;
use super::bad_input::BadInput;
use super::files::MachineFiles;
use super::number::positive;
use super::output;
use super::policy::PolicyArguments;
use super::progress::ProgressBarOnScreen;
use super::random::RandomOptions;
use super::scheme::OwnArguments;
use super::{offered, position_argument, target};
use clap::Args;
use trueaxis_model::policy::stored;
use trueaxis_report::scheme_comparison::{compare, single, single_schemes};
use trueaxis_tables::compile::Options;
use trueaxis_tables::schemes::{self, Scheme};

/// Compare all schemes on one machine, side by side
///
/// Runs `exact` and the schemes of the source document, and prints the figures of each verification: translation and
/// direction of the volumetric error over the whole travel, and the difference from the kinematic correction. Then
/// prints how much of each error parameter is removed (Eq. 38), identified from simulated probings with the
/// compensation on. Schemes that do not support the machine are listed with the reason. Writes no files.
///
/// With --single: the tables that `exact` and `fik` take for each error parameter by itself (section 9.2).
#[derive(Args)]
#[command(
    after_help = "Example:\n  trueaxis schemes examples/huron-k2x8/machine.toml examples/huron-k2x8/errors-13.toml --policy orientation"
)]
pub struct Arguments {
    #[command(flatten)]
    files: MachineFiles,
    #[command(flatten)]
    policy: PolicyArguments,
    #[command(flatten)]
    own: OwnArguments,
    /// Largest difference from the kinematic correction, in µm: exact meets it, the others are judged by it
    #[arg(long, value_name = "µm", default_value_t = 0.05, value_parser = positive)]
    tolerance: f64,
    /// Points of every table that is not a straight line (default: exact as many as the tolerance needs, poly25 50,
    /// trigo23 10, fik and subset 101)
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=65536))]
    points: Option<u32>,
    /// Subtract the correction at this position everywhere; axes left out are at 0
    #[arg(long, value_name = "X=0,Y=0,…")]
    zero_at: Option<String>,
    /// The controller that will run it, as in compile
    #[arg(long, value_name = "NAME|FILE", default_value = "stm32f405", value_parser = offered::targets(), hide_possible_values = true)]
    target: String,
    /// Print how many tables and terms each error parameter takes by itself, with exact and with fik
    #[arg(long)]
    single: bool,
    #[command(flatten)]
    random: RandomOptions,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    let target = target::read(&arguments.target)?;
    let (machine, errors) = arguments.files.read()?;
    let every = match arguments.single {
        false => Scheme::every(),
        true => single_schemes(),
    };
    let schemes = every.iter().map(|one| arguments.own.with(one, &machine));
    let schemes = schemes.collect::<Result<Vec<_>, _>>()?.concat();
    let zero_at = arguments.zero_at.as_deref();
    let options = Options {
        tables: schemes::Options {
            policy: arguments.policy.kinematic()?,
            tolerance: arguments.tolerance * 1e-3,
            points: arguments.points.map(|n| n as usize),
            format: target.samples,
            zero_at: position_argument::zero_position(zero_at, &machine)?,
            target,
        },
        random: arguments.random.random as usize,
        seed: arguments.random.seed,
        ..Options::default()
    };
    let policy = stored(options.tables.policy);
    let bar = ProgressBarOnScreen::new();
    if arguments.single {
        let found = single(&machine, &errors, &schemes, &options, zero_at, &bar);
        drop(bar);
        output::print_answer(arguments.json, &found, || shown::singles(&found, policy))?;
        return Ok(Outcome::Done);
    }
    let found = compare(&machine, &errors, &schemes, &options, zero_at, &bar);
    drop(bar);
    output::print_answer(arguments.json, &found, || shown::comparison(&found, policy))?;
    Ok(Outcome::Done)
}
