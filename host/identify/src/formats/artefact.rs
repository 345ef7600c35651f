//! `artefact.toml`: what is known about balls, bars and stylus before probing.

use nalgebra::Vector3;
use serde::Deserialize;
use toml::Spanned;
use trueaxis_model::machine::Machine;
use trueaxis_model::source::{Exactly, FileError};

/// What is known about an artefact.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Artefact {
    /// Balls.
    pub balls: Vec<Ball>,
    /// Known distances between balls.
    pub bars: Vec<ArtefactBar>,
    /// The stylus tip.
    pub stylus: Stylus,
}

/// A ball.
#[derive(Clone, Debug, PartialEq)]
pub struct Ball {
    /// Name, as in the probings.
    pub name: String,
    /// Approximate centre in the workpiece frame (mm).
    pub nominal: Option<Vector3<f64>>,
    /// Unit vector from the table, on which the stem stands, towards the centre (workpiece frame).
    pub away: Vector3<f64>,
    /// The post on which it stands, for the check of collisions.
    pub post: Option<Post>,
}

/// A round post from a ball towards the table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Post {
    /// Diameter (mm).
    pub diameter: f64,
    /// From the centre of the ball to the table (mm).
    pub height: f64,
}

/// A known distance between the centres of two balls.
#[derive(Clone, Debug, PartialEq)]
pub struct ArtefactBar {
    /// Names of the balls.
    pub balls: [String; 2],
    /// Length (mm).
    pub length: f64,
    /// Standard uncertainty (mm).
    pub uncertainty: f64,
}

/// The stylus tip in the spindle frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Stylus {
    /// Approximate position (mm); for a missing coordinate, that of the machine's own tool tip.
    pub tip: [Option<f64>; 3],
    /// Standard uncertainty of each coordinate (mm) if it is known: of the length of a stylus measured outside the
    /// machine, or across it if its run-out was zeroed.
    pub uncertainty: [Option<f64>; 3],
    /// What is above the tip, for the check of collisions.
    pub shaft: Option<Shaft>,
}

/// A stylus above its tip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shaft {
    /// Diameter (mm).
    pub diameter: f64,
    /// From the centre of the tip to the shank (mm); without one, it reaches to the spindle frame.
    pub length: Option<f64>,
    /// Diameter (mm) from there to the spindle frame.
    pub shank: Option<f64>,
}

impl Stylus {
    /// Position in the spindle of a machine (mm).
    #[must_use]
    pub fn place(&self, machine: &Machine) -> Vector3<f64> {
        Vector3::from_fn(|k, _| self.tip[k].unwrap_or(machine.tip[k]))
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ArtefactEntries {
    #[serde(default)]
    ball: Vec<BallEntry>,
    #[serde(default)]
    bar: Vec<BarEntry>,
    stylus: Option<StylusEntry>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct BallEntry {
    name: Spanned<String>,
    nominal_mm: Option<Spanned<Exactly<3>>>,
    away_from_table: Option<Spanned<Exactly<3>>>,
    post_diameter_mm: Option<Spanned<f64>>,
    post_height_mm: Option<Spanned<f64>>,
}

impl BallEntry {
    fn post(&self) -> Result<Option<Post>, FileError> {
        match (&self.post_diameter_mm, &self.post_height_mm) {
            (None, None) => Ok(None),
            (Some(diameter), Some(height)) => Ok(Some(Post {
                diameter: positive(diameter)?,
                height: positive(height)?,
            })),
            (Some(one), None) | (None, Some(one)) => Err(FileError::at(
                one.span(),
                "a post has a diameter and a height",
                "only one of them",
                "write post_diameter_mm, and post_height_mm from the centre of the ball to the table",
            )),
        }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct BarEntry {
    balls: Spanned<Vec<String>>,
    length_mm: Spanned<f64>,
    standard_uncertainty_mm: Spanned<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct StylusEntry {
    tip_mm: Option<Spanned<Exactly<3>>>,
    length_standard_uncertainty_mm: Option<Spanned<f64>>,
    x_mm: Option<Spanned<f64>>,
    y_mm: Option<Spanned<f64>>,
    z_mm: Option<Spanned<f64>>,
    x_standard_uncertainty_mm: Option<Spanned<f64>>,
    y_standard_uncertainty_mm: Option<Spanned<f64>>,
    z_standard_uncertainty_mm: Option<Spanned<f64>>,
    shaft_diameter_mm: Option<Spanned<f64>>,
    length_mm: Option<Spanned<f64>>,
    shank_diameter_mm: Option<Spanned<f64>>,
}

impl StylusEntry {
    fn shaft(&self) -> Result<Option<Shaft>, FileError> {
        let size = |value: &Option<Spanned<f64>>| value.as_ref().map(positive).transpose();
        let needs = |one: &Option<Spanned<f64>>, other: &Option<Spanned<f64>>, text: &str| {
            let missing = one.as_ref().filter(|_| other.is_none());
            missing.map_or(Ok(()), |one| {
                let what = "the stylus is not described as far as here";
                Err(FileError::here(one.span(), what, text))
            })
        };
        needs(
            &self.length_mm,
            &self.shaft_diameter_mm,
            "add shaft_diameter_mm",
        )?;
        needs(
            &self.shank_diameter_mm,
            &self.length_mm,
            "add length_mm, from the centre of the tip to the shank",
        )?;
        Ok(match size(&self.shaft_diameter_mm)? {
            None => None,
            Some(diameter) => Some(Shaft {
                diameter,
                length: size(&self.length_mm)?,
                shank: size(&self.shank_diameter_mm)?,
            }),
        })
    }

    fn read(&self, tool_axis: usize) -> Result<Stylus, FileError> {
        let mut stylus = Stylus {
            shaft: self.shaft()?,
            ..Stylus::default()
        };
        if let Some(tip) = &self.tip_mm {
            stylus.tip = <[f64; 3]>::from(point(tip)?).map(Some);
        }
        if let Some(known) = &self.length_standard_uncertainty_mm {
            stylus.uncertainty[tool_axis] = Some(positive(known)?);
        }
        let each = [
            (&self.x_mm, &self.x_standard_uncertainty_mm),
            (&self.y_mm, &self.y_standard_uncertainty_mm),
            (&self.z_mm, &self.z_standard_uncertainty_mm),
        ];
        for (k, (place, known)) in each.into_iter().enumerate() {
            let name = ["x", "y", "z"][k];
            if let Some(place) = place {
                let span = place.span();
                let value = *place.get_ref();
                if value.is_nan() || value.abs() >= LARGEST {
                    return Err(FileError::here(
                        span,
                        "this is not a place on a machine",
                        "write mm in the spindle frame",
                    ));
                }
                if self.tip_mm.is_some() {
                    return Err(FileError::at(
                        span,
                        format!("tip_mm already says where the stylus is in {name}"),
                        "stated twice",
                        format!("keep tip_mm or {name}_mm"),
                    ));
                }
                stylus.tip[k] = Some(value);
            }
            if let Some(known) = known {
                if stylus.tip[k].is_none() {
                    return Err(FileError::here(
                        known.span(),
                        format!("an uncertainty in {name} without the coordinate itself"),
                        format!(
                            "add {name}_mm, where the stylus tip is in the spindle frame: 0.0 if it was zeroed for run-out"
                        ),
                    ));
                }
                stylus.uncertainty[k] = Some(positive(known)?);
            }
        }
        Ok(stylus)
    }
}

/// Largest distance between any two things on a machine (mm).
const LARGEST: f64 = 1e5;

impl Artefact {
    /// Parses the file. `tool_axis` is the axis of the spindle frame along which the stylus points (0, 1, 2).
    ///
    /// # Errors
    /// [`FileError`]: syntax, unknown keys, a ball that is listed twice, a bar between equal or unlisted balls,
    /// impossible lengths or uncertainties.
    pub fn from_toml(text: &str, tool_axis: usize) -> Result<Self, FileError> {
        let file: ArtefactEntries =
            toml::from_str(text).map_err(|error| FileError::syntax(&error, text))?;
        let mut artefact = Self::default();
        for ball in file.ball {
            let (name, span) = (ball.name.get_ref(), ball.name.span());
            if artefact.balls.iter().any(|b| b.name == *name) {
                return Err(FileError::at(
                    span,
                    format!("ball `{name}` is listed twice"),
                    "the second one",
                    "give every ball its own name",
                ));
            }
            artefact.balls.push(Ball {
                name: name.clone(),
                post: ball.post()?,
                nominal: ball.nominal_mm.map(|p| point(&p)).transpose()?,
                away: (ball.away_from_table).map_or(Ok(Vector3::z()), |d| direction(&d))?,
            });
        }
        for bar in file.bar {
            artefact.bars.push(read_bar(&bar, &artefact.balls)?);
        }
        if let Some(stylus) = file.stylus {
            artefact.stylus = stylus.read(tool_axis)?;
        }
        Ok(artefact)
    }
}

fn read_bar(bar: &BarEntry, balls: &[Ball]) -> Result<ArtefactBar, FileError> {
    let span = bar.balls.span();
    let ends: [String; 2] = bar.balls.get_ref().clone().try_into().map_err(|_| {
        FileError::here(
            span.clone(),
            "a bar has two balls",
            "write balls = [\"1\", \"2\"]",
        )
    })?;
    if ends[0] == ends[1] {
        return Err(FileError::here(
            span,
            "both ends of the bar are the same ball",
            "name two balls",
        ));
    }
    if let Some(name) = (ends.iter()).find(|name| !balls.iter().any(|b| b.name == **name)) {
        return Err(FileError::at(
            span,
            format!("there is no ball `{name}`"),
            "unknown ball",
            format!("add [[ball]] with name = \"{name}\" above, or correct the name"),
        ));
    }
    Ok(ArtefactBar {
        balls: ends,
        length: positive(&bar.length_mm)?,
        uncertainty: positive(&bar.standard_uncertainty_mm)?,
    })
}

fn point(value: &Spanned<Exactly<3>>) -> Result<Vector3<f64>, FileError> {
    let point = Vector3::from(value.get_ref().0);
    if point.iter().all(|v| v.abs() < LARGEST) {
        return Ok(point);
    }
    Err(FileError::here(
        value.span(),
        "this is not a place on a machine",
        "write x, y and z in mm",
    ))
}

fn direction(value: &Spanned<Exactly<3>>) -> Result<Vector3<f64>, FileError> {
    let direction = Vector3::from(value.get_ref().0);
    let unit = direction.try_normalize(f64::MIN_POSITIVE);
    unit.filter(|u| u.iter().all(|v| v.is_finite()))
        .ok_or_else(|| {
            FileError::here(
                value.span(),
                "this is not a direction",
                "write a vector from the table to the ball in the workpiece frame: [0.0, 0.0, 1.0]",
            )
        })
}

fn positive(value: &Spanned<f64>) -> Result<f64, FileError> {
    let length = *value.get_ref();
    if length > 0.0 && length < LARGEST {
        return Ok(length);
    }
    Err(FileError::here(
        value.span(),
        format!("{length} is no such length"),
        "write mm, more than 0",
    ))
}
