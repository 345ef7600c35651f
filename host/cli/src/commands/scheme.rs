//! `--scheme`, and the options of single schemes.

use super::bad_input::BadInput;
use super::number::positive;
use super::offered;
use super::position_argument;
use clap::{Args, ValueEnum};
use trueaxis_model::errors::Parameter;
use trueaxis_model::machine::Machine;
use trueaxis_tables::schemes::{Scheme, exact, grid3d, poly25};

/// The scheme and its options.
#[derive(Args)]
pub struct SchemeArguments {
    /// How tables are found: exact (finds the factors itself, for any machine and any errors), or a scheme of the
    /// source document: grid3d (corrections at the nodes of a grid of the linear axes), poly25 (sums of cubic
    /// polynomials), trigo23 (products with trigonometric functions), trigo23:free (with a free function for each
    /// constant), fik (a chain of tables for each closed-form term of each error) or subset:N (the N tables that
    /// remove most)
    #[arg(long, value_name = "NAME", default_value = "exact", value_parser = offered::schemes(), hide_possible_values = true)]
    scheme: Scheme,
    #[command(flatten)]
    own: OwnArguments,
}

/// Options that only one scheme has.
#[derive(Args)]
pub struct OwnArguments {
    /// exact: minimize instructions per evaluation (cost, the default) or the number of tables
    #[arg(long, value_enum, value_name = "WHAT")]
    minimize: Option<exact::Minimize>,
    /// poly25: minimize the difference from the kinematic correction of each axis (corrections, the default), or the
    /// remaining volumetric error, mm and rad in one sum (error, Eqs. 28 to 30)
    #[arg(long, value_enum, value_name = "WHAT")]
    objective: Option<poly25::Objective>,
    /// grid3d: stop refining when one more node changes the root mean square of the remaining error by less than
    /// this, in µm (default: 0.1)
    #[arg(long, value_name = "µm", value_parser = positive)]
    threshold: Option<f64>,
    /// grid3d: root mean square of Eq. 12: usual (the default), or as printed, which is 1/√2000 of it
    #[arg(long, value_enum, value_name = "WHICH")]
    rms: Option<grid3d::Rms>,
    /// grid3d: choose the number of nodes for each axis, instead of the same for all
    #[arg(long)]
    per_axis: bool,
    /// grid3d: largest number of nodes along an axis (default: 25)
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=100))]
    max_nodes: Option<u32>,
    /// grid3d: place nodes over the travel (the default) or only over the calibrated range
    #[arg(long, value_enum, value_name = "WHERE")]
    zone: Option<GridZone>,
    /// grid3d: the three axes of the grid, linear or rotary (default: the linear axes)
    #[arg(long, value_name = "X,Y,C")]
    inputs: Option<String>,
    /// grid3d: position of the other axes for which the grid is made (default: 0); axes left out are at 0. Repeat
    /// for several positions; each gets its own file, FILE-A0-C90.trax
    #[arg(long, value_name = "A=0,C=0")]
    rotary: Vec<String>,
    /// poly25, trigo23: number of positions along each axis of the grid to which tables are fitted (default: 10)
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(4..=30))]
    nodes: Option<u32>,
    /// fik: errors whose weights can be set on the controller, for example EZ0S,EXX1 (default: none)
    #[arg(long, value_name = "NAMES", value_delimiter = ',', value_parser = parameter)]
    adjust: Option<Vec<Parameter>>,
}

/// The three axes of `--inputs`.
fn inputs(text: &str, machine: &Machine) -> Result<[usize; 3], BadInput> {
    let letters: Vec<String> = machine.axes.iter().map(|a| a.letter.to_string()).collect();
    let bad = |cause: String| {
        let remedy = format!(
            "name three different axes of {}, for example X,Y,{}",
            letters.join(", "),
            letters
                .iter()
                .find(|l| !"XY".contains(*l))
                .map_or("Z", |l| l)
        );
        Err(BadInput::new(format!("--inputs {text}: {cause}"), remedy))
    };
    let mut found = Vec::new();
    for name in text.split(',').map(|name| name.trim().to_ascii_uppercase()) {
        match letters.iter().position(|letter| *letter == name) {
            None => return bad(format!("the machine has no axis `{name}`")),
            Some(axis) if found.contains(&axis) => return bad(format!("{name} is named twice")),
            Some(axis) => found.push(axis),
        }
    }
    let count = found.len();
    match <[usize; 3]>::try_from(found) {
        Ok(found) => Ok(found),
        Err(_) => bad(format!("a grid has three axes, not {count}")),
    }
}

fn parameter(name: &str) -> Result<Parameter, String> {
    Parameter::parse(name)
        .ok_or_else(|| format!("`{name}` is not an error parameter: write EB0A or EXX1"))
}

#[derive(Clone, Copy, ValueEnum)]
enum GridZone {
    /// Over the whole travel of each axis
    Travel,
    /// Where no error motion of the axis holds its end value
    Calibrated,
}

impl SchemeArguments {
    /// The scheme with its options. If there is one grid for each position of the rotary axes, there are several,
    /// each with its position as part of a file name.
    pub fn schemes(&self, machine: &Machine) -> Result<Vec<(Scheme, String)>, BadInput> {
        let name = self.scheme.name();
        let chosen = name.split(':').next().unwrap_or_default();
        self.own.belong_to(chosen, &name)?;
        let schemes = self.own.with(&self.scheme, machine)?;
        let named = schemes.into_iter().map(|scheme| {
            let held = scheme.held(machine).into_iter();
            let held: Vec<String> = held
                .map(|(axis, position)| format!("{}{position}", machine.axes[axis].letter))
                .collect();
            (scheme, held.join("-"))
        });
        let named: Vec<(Scheme, String)> = named.collect();
        for (k, (_, place)) in named.iter().enumerate() {
            if named[..k].iter().any(|(_, other)| other == place) {
                return Err(BadInput::new(
                    format!("--rotary: {place} is given twice"),
                    "give each position of the rotary axes once",
                ));
            }
        }
        Ok(named)
    }
}

impl OwnArguments {
    /// The given options, each with the schemes that have it.
    fn given(&self) -> Vec<(&'static str, &'static [&'static str])> {
        let all: [(_, &[_], _); 11] = [
            ("--threshold", &["grid3d"], self.threshold.is_some()),
            ("--rms", &["grid3d"], self.rms.is_some()),
            ("--per-axis", &["grid3d"], self.per_axis),
            ("--max-nodes", &["grid3d"], self.max_nodes.is_some()),
            ("--zone", &["grid3d"], self.zone.is_some()),
            ("--inputs", &["grid3d"], self.inputs.is_some()),
            ("--rotary", &["grid3d"], !self.rotary.is_empty()),
            ("--minimize", &["exact"], self.minimize.is_some()),
            ("--objective", &["poly25"], self.objective.is_some()),
            ("--nodes", &["poly25", "trigo23"], self.nodes.is_some()),
            ("--adjust", &["fik"], self.adjust.is_some()),
        ];
        let given = all.into_iter().filter(|(_, _, is_given)| *is_given);
        given.map(|(option, owners, _)| (option, owners)).collect()
    }

    /// Refuses options of other schemes than the chosen one.
    fn belong_to(&self, chosen: &str, name: &str) -> Result<(), BadInput> {
        let mut given = self.given().into_iter();
        let Some((option, owners)) = given.find(|(_, owners)| !owners.contains(&chosen)) else {
            return Ok(());
        };
        let why = match option {
            // Applies to every scheme that folds several errors into one table, not only `poly25`.
            "--adjust" => ": its tables belong to all errors together, and no weight to one error",
            _ => "",
        };
        let owners = owners.join(" or ");
        Err(BadInput::new(
            format!("{option} is given, but --scheme {name} knows nothing of it{why}"),
            format!("leave out {option}, or use --scheme {owners}"),
        ))
    }

    /// A scheme with the given options of its own, one for each given position of the rotary axes.
    pub fn with(&self, scheme: &Scheme, machine: &Machine) -> Result<Vec<Scheme>, BadInput> {
        let mut scheme = scheme.clone();
        match &mut scheme {
            Scheme::Exact { minimize } => *minimize = self.minimize.unwrap_or(*minimize),
            Scheme::Grid3d(wanted) => {
                wanted.threshold = self.threshold.map_or(wanted.threshold, |um| 1e-3 * um);
                wanted.rms = self.rms.unwrap_or(wanted.rms);
                wanted.per_axis = self.per_axis;
                wanted.most = self.max_nodes.map_or(wanted.most, |n| n as usize);
                wanted.calibrated = matches!(self.zone, Some(GridZone::Calibrated));
                let inputs = self.inputs.as_deref().map(|text| inputs(text, machine));
                wanted.inputs = inputs.transpose()?;
                let wanted = wanted.clone();
                let at = |text: &String| {
                    let rotary = position_argument::within_travel("--rotary", text, machine)?;
                    Ok(Scheme::Grid3d(grid3d::Wanted {
                        rotary: Some(rotary),
                        ..wanted.clone()
                    }))
                };
                if !self.rotary.is_empty() {
                    return self.rotary.iter().map(at).collect();
                }
            }
            Scheme::Poly25(wanted) => {
                wanted.nodes = self.nodes.map_or(wanted.nodes, |n| n as usize);
                wanted.objective = self.objective.unwrap_or(wanted.objective);
            }
            Scheme::Trigo23(wanted) => {
                wanted.nodes = self.nodes.map_or(wanted.nodes, |n| n as usize);
            }
            Scheme::Fik { adjustable } => {
                *adjustable = self.adjust.clone().unwrap_or_default();
            }
            Scheme::Subset { .. } => {}
        }
        Ok(vec![scheme])
    }
}
