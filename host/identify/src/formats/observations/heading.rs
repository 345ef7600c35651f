//! The set-ups: the lines that begin with `#`.

use super::{InstrumentSetup, Observations, PlacePrior, STYLUS, ToolPoint, angles};
use crate::instrument::{Kind, SetupPriors};
use nalgebra::Vector3;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::fmt::Write;
use toml::Spanned;
use trueaxis_model::formats::csv;
use trueaxis_model::kinematics::Htm;
use trueaxis_model::source::{Exactly, FileError};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Entries {
    #[serde(default)]
    setup: BTreeMap<String, Spanned<HeadingEntry>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct HeadingEntry {
    place_mm: Option<Spanned<Exactly<3>>>,
    orientation_deg: Option<Spanned<Exactly<3>>>,
    orientation_standard_uncertainty_urad: Option<Spanned<f64>>,
    dead_length_mm: Option<Spanned<f64>>,
    dead_length_standard_uncertainty_mm: Option<Spanned<f64>>,
    tool: Option<Spanned<String>>,
    tool_mm: Option<Spanned<Exactly<3>>>,
    tool_standard_uncertainty_mm: Option<Spanned<f64>>,
}

/// The heading of a file.
pub struct ObservationHeading {
    entries: Entries,
}

/// Largest distance between any two things (mm).
const LARGEST: f64 = 1e5;
const EXAMPLE: &str = "the lines with # describe set-ups: # [setup.bar], then # place_mm = [0.0, 0.0, 50.0], orientation_deg, orientation_standard_uncertainty_urad, dead_length_mm, dead_length_standard_uncertainty_mm, tool, tool_mm or tool_standard_uncertainty_mm, each in a line of its own";

impl ObservationHeading {
    /// Parses the heading; also returns where it ends.
    pub fn read(text: &str) -> Result<(Self, usize), FileError> {
        let (entries, end): (Entries, usize) = csv::heading(text, EXAMPLE)?;
        for entry in entries.setup.values() {
            entry.get_ref().check()?;
        }
        Ok((Self { entries }, end))
    }

    /// Adds a set-up; returns its number.
    pub fn add(&self, all: &mut Observations, name: &str, kind: Kind) -> usize {
        let entry = self.entries.setup.get(name).map(Spanned::get_ref);
        let vector = |v: &Spanned<Exactly<3>>| Vector3::from(v.get_ref().0);
        let given = entry.map_or(SetupPriors::default(), |entry| SetupPriors {
            place: entry.place_mm.as_ref().map(vector),
            turn: entry.orientation_deg.as_ref().map(|angles| {
                let [a, b, c] = angles.get_ref().0.map(f64::to_radians);
                Htm::from_xyz_abc([0.0, 0.0, 0.0, a, b, c]).r
            }),
            turn_sigma: (entry.orientation_standard_uncertainty_urad.as_ref())
                .map(|v| *v.get_ref() * 1e-6),
            length: entry.dead_length_mm.as_ref().map(|v| *v.get_ref()),
            length_sigma: (entry.dead_length_standard_uncertainty_mm.as_ref())
                .map(|v| *v.get_ref()),
        });
        let tool = entry.and_then(|e| e.tool.as_ref());
        let tool = tool.map_or(name, |tool| tool.get_ref());
        let sigma = entry.and_then(|e| e.tool_standard_uncertainty_mm.as_ref());
        let point = ToolPoint {
            name: tool.to_owned(),
            place: entry.and_then(|e| e.tool_mm.as_ref()).map(vector),
            known: match (sigma, kind) {
                (Some(sigma), _) => PlacePrior::Within(*sigma.get_ref()),
                (None, Kind::Length | Kind::Point | Kind::Surface) => PlacePrior::Unknown,
                (None, Kind::Displacement | Kind::Angle) => PlacePrior::Exactly,
            },
        };
        let known = all.tools.iter().position(|t| t.name == tool);
        let tool = known.unwrap_or(all.tools.len());
        match known {
            None => all.tools.push(point),
            // The first set-up that states something about a shared point does so for all.
            Some(known) => {
                let shared = &mut all.tools[known];
                shared.place = shared.place.or(point.place);
                shared.known = match (shared.known, point.known) {
                    (PlacePrior::Within(sigma), _) | (_, PlacePrior::Within(sigma)) => {
                        PlacePrior::Within(sigma)
                    }
                    (PlacePrior::Unknown, _) | (_, PlacePrior::Unknown) => PlacePrior::Unknown,
                    (PlacePrior::Exactly, PlacePrior::Exactly) => PlacePrior::Exactly,
                };
            }
        }
        all.setups.push(InstrumentSetup {
            name: name.to_owned(),
            kind,
            given,
            tool,
        });
        all.setups.len() - 1
    }

    /// Refuses set-ups that no line has, and entries that do not belong to their kind.
    pub fn is_used(&self, all: &Observations) -> Result<(), FileError> {
        for (name, entry) in &self.entries.setup {
            let Some(setup) = all.setups.iter().find(|s| s.name == *name) else {
                return Err(FileError::here(
                    entry.span(),
                    format!("no line has the set-up `{name}`"),
                    "correct its name, or leave it out",
                ));
            };
            entry.get_ref().belongs(setup.kind)?;
        }
        Ok(())
    }
}

impl HeadingEntry {
    fn check(&self) -> Result<(), FileError> {
        for place in [&self.place_mm, &self.tool_mm].into_iter().flatten() {
            if !place.get_ref().0.iter().all(|v| v.abs() < LARGEST) {
                let message = "this is not a place on a machine";
                return Err(FileError::here(
                    place.span(),
                    message,
                    "write x, y and z in mm",
                ));
            }
        }
        if let Some(angles) = &self.orientation_deg
            && !angles.get_ref().0.iter().all(|v| v.abs() <= 360.0)
        {
            return Err(FileError::here(
                angles.span(),
                "these are not angles of an orientation",
                "write degrees about x, y and z, in this order",
            ));
        }
        if let Some(length) = &self.dead_length_mm
            && (length.get_ref().is_nan() || length.get_ref().abs() >= LARGEST)
        {
            let message = "this is not a length on a machine";
            return Err(FileError::here(length.span(), message, "write mm"));
        }
        let sigmas = [
            &self.orientation_standard_uncertainty_urad,
            &self.dead_length_standard_uncertainty_mm,
            &self.tool_standard_uncertainty_mm,
        ];
        for sigma in sigmas.into_iter().flatten() {
            if !(1e-9..LARGEST).contains(sigma.get_ref()) {
                return Err(FileError::here(
                    sigma.span(),
                    format!("{} cannot be a standard uncertainty", sigma.get_ref()),
                    "write it in the unit of its name, more than 0; leave it out if unknown",
                ));
            }
        }
        if let (Some(tool), true) = (&self.tool, self.states_tool())
            && tool.get_ref() == STYLUS
        {
            return Err(FileError::here(
                tool.span(),
                "the place of the stylus is stated in the artefact",
                "leave out tool_mm and tool_standard_uncertainty_mm",
            ));
        }
        Ok(())
    }

    fn states_tool(&self) -> bool {
        self.tool_mm.is_some() || self.tool_standard_uncertainty_mm.is_some()
    }

    fn belongs(&self, kind: Kind) -> Result<(), FileError> {
        let lengths = [
            &self.dead_length_mm,
            &self.dead_length_standard_uncertainty_mm,
        ];
        let length = lengths.into_iter().flatten().next();
        let place = self.place_mm.as_ref().filter(|_| kind == Kind::Angle);
        let turn = (self.orientation_deg.as_ref()).filter(|_| kind == Kind::Length);
        let turn_sigma = self.orientation_standard_uncertainty_urad.as_ref();
        let wrong = [
            length.filter(|_| kind != Kind::Length).map(Spanned::span),
            place.map(Spanned::span),
            turn.map(Spanned::span),
            turn_sigma
                .filter(|_| kind == Kind::Length)
                .map(Spanned::span),
        ];
        match wrong.into_iter().flatten().next() {
            None => Ok(()),
            Some(span) => Err(FileError::here(
                span,
                format!("the set-up of {} does not have this", kind.one()),
                "leave it out",
            )),
        }
    }
}

/// The heading of a file with these set-ups.
pub fn write(all: &Observations) -> String {
    let mut text = String::new();
    let mut stated = vec![false; all.tools.len()];
    for setup in &all.setups {
        let tool = &all.tools[setup.tool];
        let given = &setup.given;
        let is_first = !std::mem::replace(&mut stated[setup.tool], true);
        let list = |v: [f64; 3]| format!("[{:?}, {:?}, {:?}]", v[0], v[1], v[2]);
        let number = |v: f64| format!("{v:?}");
        let turn = |turn| angles(&turn).map(|v| (v * 1e9).round() / 1e9 + 0.0);
        let entries = [
            ("place_mm", given.place.map(|place| list(place.into()))),
            ("orientation_deg", given.turn.map(|of| list(turn(of)))),
            (
                "orientation_standard_uncertainty_urad",
                given.turn_sigma.map(|v| number((v * 1e15).round() * 1e-9)),
            ),
            ("dead_length_mm", given.length.map(number)),
            (
                "dead_length_standard_uncertainty_mm",
                given.length_sigma.map(number),
            ),
            (
                "tool",
                (tool.name != setup.name).then(|| toml::Value::from(&*tool.name).to_string()),
            ),
            (
                "tool_mm",
                tool.place.filter(|_| is_first).map(|at| list(at.into())),
            ),
            (
                "tool_standard_uncertainty_mm",
                match tool.known {
                    PlacePrior::Within(sigma) if is_first => Some(number(sigma)),
                    _ => None,
                },
            ),
        ];
        let entries = entries.into_iter();
        let entries = entries.filter_map(|(name, value)| Some(format!("# {name} = {}\n", value?)));
        let entries: String = entries.collect();
        if !entries.is_empty() {
            let is_bare = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
            let name = match setup.name.chars().all(is_bare) {
                true => setup.name.clone(),
                false => toml::Value::from(setup.name.as_str()).to_string(),
            };
            let _ = write!(text, "# [setup.{name}]\n{entries}");
        }
    }
    text
}
