//! The squareness of three axes, and heights over X and Y: what Klipper, Marlin and RepRapFirmware correct.
//!
//! They add multiples of Y and Z to the command of X, and a multiple of Z to that of Y. A linear part of all corrections
//! is found by least squares over the travel. It has nine coefficients: three of squareness, three scales, and a rotation
//! of the whole work, which does not matter because work is aligned by itself (and a bed is levelled). The text is read
//! again, evaluated as the firmware does it, and compared with the compensation.

pub mod measured;

use crate::NotExported;
use crate::height_map::HeightMap;
use crate::klipper::bed_mesh;
use crate::positions::{letters, random_of, travel, xyz};
use crate::reprapfirmware;
use crate::sampled::{Nodes, OtherAxes, SampledGrid, without_direction};
use nalgebra::{DMatrix, DVector};
use serde::Serialize;
use trueaxis_model::parallel;
use trueaxis_model::source::FileError;
use trueaxis_model::validate::{Command, Runtime};

/// A firmware of printers and light routers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Firmware {
    /// `SET_SKEW`.
    Klipper,
    /// `M852`.
    Marlin,
    /// `M556`.
    RepRapFirmware,
}

/// What to do about machines that these firmwares do not correct.
const OTHER: &str = "compile a machine with three linear axes for it; `trueaxis gcode` corrects programs for any controller";
/// What to do about a map that the firmware does not read.
const MAP: &str = "give fewer --points, or look at the values with `trueaxis inspect`";

/// Linear corrections: of X by Y, of X by Z, of Y by Z (mm per mm), with the sign of a correction of the command.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Skew {
    /// Correction of X per mm of Y.
    pub x_by_y: f64,
    /// Correction of X per mm of Z.
    pub x_by_z: f64,
    /// Correction of Y per mm of Z.
    pub y_by_z: f64,
}

/// What the firmware corrects, and what it leaves.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SkewFound {
    /// What is written.
    pub skew: Skew,
    /// By what the steps per mm of X, Y and Z must be multiplied, which the text does not do.
    pub steps: [f64; 3],
    /// Rotation of the work about X, Y and Z that the compensation corrects and the text does not (µrad).
    pub turned_urad: [f64; 3],
    /// X, Y and Z.
    pub axes: [RemainingOnAxis; 3],
    /// Largest corrections of X and Y (µm) where the firmware does not apply them, if there are such places.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at_ends_um: Option<[f64; 2]>,
    /// What Klipper leaves of the map along a move (µm) unless its configuration says otherwise.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub split_um: Option<f64>,
    /// Number of random positions with random directions of travel.
    pub positions: usize,
}

/// What is written.
#[derive(Clone, Debug, PartialEq)]
pub struct SkewWritten {
    /// The lines that set the squareness.
    pub lines: String,
    /// The height map, if one was wanted.
    pub map: Option<String>,
}

/// Fewest positions for the factors.
const LEAST_FITTED: usize = 1000;
/// `split_delta_z` of Klipper by default (µm): a move is cut where the map has changed by so much.
const KLIPPER_SPLITS: f64 = 25.0;
/// Name of the profile that is written for Klipper.
pub(crate) const PROFILE: &str = "trueaxis";

/// An axis.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct RemainingOnAxis {
    /// Largest correction of the compensation (µm), but for a constant and the rotation of the work.
    pub largest_um: f64,
    /// Largest difference from what the firmware corrects (µm), but for these.
    pub left_um: f64,
    /// Like `left_um`, if the steps per mm are changed, too (µm).
    pub left_with_steps_um: f64,
}

/// Side (mm) of the rhombus whose diagonals are given to Klipper.
const SIDE: f64 = 100.0;
/// Length (mm) over which `M556` gives the deviations of the axes.
const HEIGHT: f64 = 1000.0;
/// Marlin accepts factors up to this.
const MARLIN: f64 = 1.0;

impl Firmware {
    /// The lines that set a skew, ready for a console or a start-up file.
    ///
    /// # Errors
    /// [`NotExported`]
    pub fn print(self, skew: &Skew) -> Result<String, NotExported> {
        let Skew {
            x_by_y,
            x_by_z,
            y_by_z,
        } = *skew;
        // These two subtract x·y and z·(xz − xy·yz).
        let (xy, yz) = (-x_by_y, -y_by_z);
        let xz = xy * yz - x_by_z;
        if let Some(large) = [xy, xz, yz]
            .into_iter()
            .find(|factor| factor.abs() > MARLIN)
        {
            return Err(NotExported::new(
                format!("a skew of {large} is more than the firmware accepts"),
                OTHER,
            ));
        }
        Ok(match self {
            Self::Klipper => {
                let lengths = [("XY", xy), ("XZ", xz), ("YZ", yz)].map(|(plane, factor)| {
                    // A rhombus whose angle differs by asin k from a right one.
                    let k = factor / (1.0 + factor * factor).sqrt();
                    let diagonal = |k: f64| SIDE * (2.0 * (1.0 + k)).sqrt();
                    format!(" {plane}={:.9},{:.9},{SIDE}", diagonal(k), diagonal(-k))
                });
                format!("SET_SKEW{}\n", lengths.concat())
            }
            Self::Marlin => format!("G21\nM852 I{xy:.9} J{xz:.9} K{yz:.9}\n"),
            Self::RepRapFirmware => format!(
                "M556 S{HEIGHT} X{:.6} Y{:.6} Z{:.6}\n",
                x_by_y * HEIGHT,
                y_by_z * HEIGHT,
                x_by_z * HEIGHT
            ),
        })
    }

    /// Reads the lines again.
    ///
    /// # Errors
    /// [`NotExported`]
    pub fn read(self, text: &str) -> Result<Skew, NotExported> {
        let bad = || {
            let message = format!("`{}`", text.trim());
            NotExported::unread(FileError::whole(message, ""))
        };
        let word = |start: &str| -> Option<&str> {
            let words = text.lines().flat_map(str::split_whitespace);
            words
                .filter_map(|word| word.strip_prefix(start))
                .next_back()
        };
        let number = |start: &str| {
            word(start)
                .and_then(|w| w.parse::<f64>().ok())
                .ok_or_else(bad)
        };
        let of_factors = |xy: f64, xz: f64, yz: f64| Skew {
            x_by_y: -xy,
            x_by_z: -(xz - xy * yz),
            y_by_z: -yz,
        };
        match self {
            Self::Klipper => {
                let factor = |plane: &str| {
                    let lengths = word(&format!("{plane}="));
                    lengths.and_then(factor_of_lengths).ok_or_else(bad)
                };
                Ok(of_factors(factor("XY")?, factor("XZ")?, factor("YZ")?))
            }
            Self::Marlin => Ok(of_factors(number("I")?, number("J")?, number("K")?)),
            Self::RepRapFirmware => {
                let height = number("S")?;
                Ok(Skew {
                    x_by_y: number("X")? / height,
                    x_by_z: number("Z")? / height,
                    y_by_z: number("Y")? / height,
                })
            }
        }
    }
}

/// A factor of Klipper from the lengths of two diagonals and a side.
fn factor_of_lengths(lengths: &str) -> Option<f64> {
    let lengths = lengths.split(',').map(str::parse);
    let lengths: Vec<f64> = lengths.collect::<Result<_, _>>().ok()?;
    let [ac, bd, ad] = lengths[..] else {
        return None;
    };
    // The angle at A, by the law of cosines.
    let side = (2.0 * ac * ac + 2.0 * bd * bd - 4.0 * ad * ad).sqrt() / 2.0;
    let cosine = (ac * ac - side * side - ad * ad) / (2.0 * side * ad);
    Some(libm::tan(std::f64::consts::FRAC_PI_2 - libm::acos(cosine)))
}

impl Firmware {
    /// The text of a height map, and the map as the firmware reads it.
    fn height_map(self, map: &HeightMap) -> Result<(String, HeightMap), NotExported> {
        match self {
            Self::Klipper => {
                let text = bed_mesh::print(map, PROFILE);
                let read = bed_mesh::read(&text, Some(PROFILE)).map_err(NotExported::unread)?;
                Ok((text, read))
            }
            Self::RepRapFirmware => {
                reprapfirmware::check(map).map_err(|cause| NotExported::new(cause, MAP))?;
                let text = reprapfirmware::print(map);
                let read = reprapfirmware::read(&text).map_err(NotExported::unread)?;
                Ok((text, read))
            }
            Self::Marlin => Err(NotExported::new(
                "Marlin stores no height map in a file",
                MAP,
            )),
        }
    }

    /// The correction of Z at X and Y, as the firmware computes it from a map.
    fn height(self, map: &HeightMap, position: [f64; 2]) -> f64 {
        match self {
            Self::RepRapFirmware => reprapfirmware::correction(map, position),
            _ => bed_mesh::correction(map, position),
        }
    }
}

/// Takes the skew out of a compensation, writes it for a firmware, and compares that with the compensation at
/// `positions` random positions over the travel. Returns the text and its effect.
///
/// With a number of `points` along X and Y, also writes the correction of Z as a height map over their travel: the middle of
/// what it is anywhere along Z, after travel in either direction, but for the rotation of the work, whose other parts the
/// firmware would not correct.
///
/// # Errors
/// [`NotExported`]
pub fn skew(
    runtime: &Runtime<'_>,
    firmware: Firmware,
    points: Option<[usize; 2]>,
    positions: usize,
    seed: u64,
) -> Result<(SkewWritten, SkewFound), NotExported> {
    let axes = runtime.compensation().axes();
    let indices = xyz(axes).filter(|_| axes.len() == 3);
    let [x, y, z] = indices.ok_or_else(|| {
        let axes = letters(axes);
        NotExported::new(
            format!(
                "the compensation is for the axes {axes}, and these firmwares correct X, Y and Z"
            ),
            OTHER,
        )
    })?;
    // The factors need positions all over the travel, however few are asked for to verify them.
    let commands = random_of(runtime.compensation(), positions.max(LEAST_FITTED), seed);
    let corrections = parallel::map(&commands, |command| {
        let found = runtime.evaluate(command);
        [x, y, z].map(|i| f64::from(found[i]))
    });
    let position = |command: &Command| [x, y, z].map(|i| f64::from(command.axes[i]));
    let at: Vec<[f64; 3]> = commands.iter().map(position).collect();
    let part = LinearPart::of(&at, &corrections);
    let lines = firmware.print(&part.skew)?;
    let skew = firmware.read(&lines)?;
    let map = points.map(|points| heights(runtime, [x, y, z], points, &commands, &part));
    let map = map.map(|map| firmware.height_map(&map)).transpose()?;
    let (map, by_map) = map.unzip();
    let by_text = |output: usize, p: &[f64; 3]| match output {
        0 => skew.x_by_y * p[1] + skew.x_by_z * p[2],
        1 => skew.y_by_z * p[2],
        _ => (by_map.as_ref()).map_or(0.0, |map| firmware.height(map, [p[0], p[1]])),
    };
    let found = SkewFound {
        at_ends_um: (firmware == Firmware::Marlin)
            .then(|| at_ends_um(&skew, [y, z].map(|i| travel(&axes[i])))),
        skew,
        steps: part.scale.map(|s| 1.0 + s),
        turned_urad: part.turned.map(|t| t * 1e6),
        axes: [0, 1, 2]
            .map(|output| part.remaining(output, &at, &corrections, |p| by_text(output, p))),
        split_um: (firmware == Firmware::Klipper && map.is_some()).then_some(KLIPPER_SPLITS),
        positions: commands.len(),
    };
    Ok((SkewWritten { lines, map }, found))
}

/// The correction of Z over X and Y without the rotation of the work.
fn heights(
    runtime: &Runtime<'_>,
    [x, y, z]: [usize; 3],
    points: [usize; 2],
    commands: &[Command],
    part: &LinearPart,
) -> HeightMap {
    let axes = runtime.compensation().axes();
    let rest = OtherAxes::new(axes, &[x, y], commands);
    let nodes = [(x, points[0]), (y, points[1])]
        .map(|(axis, count)| Nodes::over(travel(&axes[axis]), count));
    HeightMap::new(SampledGrid::of(&nodes, |p| {
        let set = |command: &mut Command| {
            *command = without_direction(command);
            command.axes[x] = p[0] as f32;
            command.axes[y] = p[1] as f32;
        };
        rest.middle(set, |command| {
            let at = [x, y, z].map(|i| f64::from(command.axes[i]));
            [f64::from(runtime.evaluate(command)[z]) - part.rotation(2, &at)]
        })
    }))
}

/// The linear part of corrections.
struct LinearPart {
    skew: Skew,
    /// Scales of X, Y and Z.
    scale: [f64; 3],
    /// Rotation of the work.
    turned: [f64; 3],
}

impl LinearPart {
    fn of(at: &[[f64; 3]], corrections: &[[f64; 3]]) -> Self {
        let by = linear(at, corrections);
        // A rotation r adds r × p; Y and Z then do not depend on the axes before them.
        let turned = [by[2][1], -by[2][0], by[1][0]];
        Self {
            skew: Skew {
                x_by_y: by[0][1] + turned[2],
                x_by_z: by[0][2] - turned[1],
                y_by_z: by[1][2] + turned[0],
            },
            scale: [0, 1, 2].map(|k| by[k][k]),
            turned,
        }
    }

    /// What the rotation adds at a position.
    fn rotation(&self, output: usize, p: &[f64; 3]) -> f64 {
        let [j, k] = [(output + 1) % 3, (output + 2) % 3];
        self.turned[j] * p[k] - self.turned[k] * p[j]
    }

    /// What is left of corrections at some positions, but for the rotation.
    fn remaining(
        &self,
        output: usize,
        at: &[[f64; 3]],
        corrections: &[[f64; 3]],
        by_text: impl Fn(&[f64; 3]) -> f64,
    ) -> RemainingOnAxis {
        let without_rotation =
            |row: usize| corrections[row][output] - self.rotation(output, &at[row]);
        let half_range = |left: &dyn Fn(usize) -> f64| half_range_um((0..at.len()).map(left));
        RemainingOnAxis {
            largest_um: half_range(&|row| without_rotation(row)),
            left_um: half_range(&|row| without_rotation(row) - by_text(&at[row])),
            left_with_steps_um: half_range(&|row| {
                without_rotation(row) - by_text(&at[row]) - self.scale[output] * at[row][output]
            }),
        }
    }
}

/// The linear part of corrections, by least squares: of each output the factors of X, Y and Z, and a constant.
fn linear(at: &[[f64; 3]], corrections: &[[f64; 3]]) -> [DVector<f64>; 3] {
    let matrix = DMatrix::from_fn(at.len(), 4, |row, k| if k == 3 { 1.0 } else { at[row][k] });
    // Positions fill the travel: the columns are independent.
    let square = (matrix.transpose() * &matrix).cholesky();
    [0, 1, 2].map(|output| {
        let values = DVector::from_fn(at.len(), |row, _| corrections[row][output]);
        let solved = square
            .as_ref()
            .map(|s| s.solve(&(matrix.transpose() * values)));
        solved.unwrap_or_else(|| DVector::zeros(4))
    })
}

/// Half of the distance from the smallest to the largest value (mm), in µm.
fn half_range_um(values: impl Iterator<Item = f64>) -> f64 {
    let [low, high] = values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| {
        [low.min(v), high.max(v)]
    });
    (high - low) / 2.0 * 1e3
}

/// What the factors do to X and Y at the ends of Y and Z. Marlin applies them only above 1 mm beyond the lower ends of
/// X and Y, and where they lead to within the travel.
fn at_ends_um(skew: &Skew, [y, z]: [[f64; 2]; 2]) -> [f64; 2] {
    let most = |[low, high]: [f64; 2]| low.abs().max(high.abs());
    let by_y = (skew.x_by_y * most(y)).abs();
    [
        by_y + (skew.x_by_z * most(z)).abs(),
        (skew.y_by_z * most(z)).abs(),
    ]
    .map(|mm| mm * 1e3)
}

#[cfg(test)]
mod tests;
