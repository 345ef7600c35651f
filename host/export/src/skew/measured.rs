//! From a printed or drawn rectangle to error parameters: two diagonals and a side, as users of Klipper and Marlin measure.
//!
//! The corners are A, B, C, D. A stands where both axes have their lower values, D is away from it along the first axis or
//! the second, which does not matter, and C is opposite to A: AC grows where the second axis leans towards the first.

use trueaxis_model::errors::{ErrorModel, Parameter, Situation, Switches};
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::machine::{Machine, PerAxis};

/// The planes, with the numbers of their axes and the parameters that may describe them.
pub const PLANES: [(&str, [usize; 2], [&str; 2]); 3] = [
    ("xy", [0, 1], ["EC0Y", "EC0X"]),
    ("xz", [0, 2], ["EB0Z", "EB0X"]),
    ("yz", [1, 2], ["EA0Z", "EA0Y"]),
];

/// A squareness error of more than this (mm per mm) is a mistake of measuring: 1.7°, which eyes see.
const MOST: f64 = 0.03;
/// So is a side that is longer than the other one by more than this factor: a diagonal was taken for a side.
const SLIM: f64 = 4.0;

/// What is wrong with lengths or with a machine.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MeasuredError {
    /// They cannot be the diagonals and a side of one parallelogram.
    #[error(
        "diagonals of {0} and {1} mm and a side of {2} mm are of no rectangle that is nearly right-angled, with sides of at most 4 to 1"
    )]
    Lengths(f64, f64, f64),
    /// Not a printer.
    #[error("the machine has no axes X, Y and Z along x, y and z")]
    Axes,
    /// No squareness of this plane.
    #[error("no parameter of the machine is the squareness of the plane {0}")]
    NoParameter(&'static str),
}

/// How much the second axis leans towards the first (mm per mm): the cotangent of the angle between them.
///
/// # Errors
/// [`MeasuredError::Lengths`]
pub fn lean([ac, bd, ad]: [f64; 3]) -> Result<f64, MeasuredError> {
    // Both diagonals squared give twice the squares of both sides; their difference, four times the sides' product.
    let other = (ac * ac + bd * bd) / 2.0 - ad * ad;
    let cosine = (ac * ac - bd * bd) / (4.0 * ad * other.max(0.0).sqrt());
    let lean = cosine / (1.0 - cosine * cosine).sqrt();
    let sides = ad * ad / other;
    let is_slim = !(SLIM.powi(-2)..=SLIM.powi(2)).contains(&sides);
    match lean.is_finite() && lean.abs() <= MOST && !is_slim {
        true => Ok(lean),
        false => Err(MeasuredError::Lengths(ac, bd, ad)),
    }
}

/// Directions of the nozzle along X, Y and Z, as rows.
fn directions(machine: &Machine, errors: &ErrorModel) -> Option<[[f64; 3]; 3]> {
    let kinematics = Kinematics::new(machine, errors);
    let direction = |k: usize| {
        let axis = machine.index(['X', 'Y', 'Z'][k])?;
        let at = |value: f64| {
            let mut q = PerAxis::default();
            q[axis] = value;
            let actual = kinematics.actual(&q, &Situation::default(), &Switches::ALL);
            [kinematics.nominal(&q, None).t, actual.t]
        };
        let [before, after] = [at(0.0), at(1.0)];
        let sign = (after[0] - before[0])[k];
        let by = (after[1] - before[1]) * sign;
        (sign.abs() > 0.999).then(|| [by.x, by.y, by.z])
    };
    Some([direction(0)?, direction(1)?, direction(2)?])
}

/// The parameters (rad) that make the second axis of a plane (its number in [`PLANES`]) lean so much, while the first one
/// stays: X and the bed are what everything is square to, as the firmwares have it.
///
/// # Errors
/// [`MeasuredError`]
pub fn parameters(
    machine: &Machine,
    plane: usize,
    wanted: f64,
) -> Result<[(&'static str, f64); 2], MeasuredError> {
    /// An angle for derivatives (rad).
    const ANGLE: f64 = 1e-4;
    let (name, [first, second], names) = PLANES[plane];
    if machine.axes.len() != 3 || directions(machine, &ErrorModel::perfect(machine)).is_none() {
        return Err(MeasuredError::Axes);
    }
    // How much the second axis goes along the first, and the first along the second, by each parameter.
    let by = |candidate: &str| {
        let parameter = Parameter::parse(candidate)?;
        let mut errors = ErrorModel::perfect(machine);
        let known = errors.set(machine, parameter, ANGLE);
        let found = directions(machine, &errors).filter(|_| known)?;
        Some([found[second][first], found[first][second]].map(|lean| lean / ANGLE))
    };
    let none = MeasuredError::NoParameter(name);
    let [a, b] = names.map(by);
    let ([a0, a1], [b0, b1]) = (a.ok_or(none.clone())?, b.ok_or(none.clone())?);
    /// What is less is no effect; all effects are whole numbers.
    const EFFECT: f64 = 0.5;
    let determinant = a0 * b1 - a1 * b0;
    let angle = libm::atan(wanted);
    let values = if a0.abs() > EFFECT && a1.abs() < EFFECT {
        [angle / a0, 0.0]
    } else if determinant.abs() > EFFECT {
        [b1 * angle / determinant, -a1 * angle / determinant]
    } else if plane == 0 && (a0 + a1).abs() > EFFECT {
        // On a bed that Y moves it is X that leans: the part is turned on the bed, which nobody minds. Turned about X or Y it
        // would not lie on the bed.
        [angle / (a0 + a1), 0.0]
    } else {
        return Err(none);
    };
    Ok([0, 1].map(|k| (names[k], values[k])))
}

/// A machine file for a printer with the travels of X, Y and Z (mm), whose nozzle makes all motions. Squareness does not
/// depend on which part moves.
#[must_use]
pub fn printer(travels: [[f64; 2]; 3]) -> String {
    let range = |[low, high]: [f64; 2]| format!("range = [{low:?}, {high:?}]");
    let [x, y, z] = travels.map(range);
    format!(
        "# A printer, written by `trueaxis skew`. Ranges (mm) as in the firmware: position_min and position_max,\n\
         # X_MIN_POS and X_MAX_POS, M208. Squareness does not depend on which part moves: here all\n\
         # motions are those of the nozzle.\n\
         name = \"Printer\"\n\n\
         [[axis]]\nname = \"Y\"\nbranch = \"tool\"\n{y}\n\n\
         [[axis]]\nname = \"X\"\nbranch = \"tool\"\n{x}\n\n\
         [[axis]]\nname = \"Z\"\nbranch = \"tool\"\n{z}\n\n\
         [spindle]\naxis = \"z\"\n\n\
         [tool]\ntip_mm = [0.0, 0.0, -40.0]\n"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Corners of a parallelogram whose second side leans by `lean` towards the first.
    fn lengths(first: f64, second: f64, lean: f64) -> [f64; 3] {
        let up = second / (1.0 + lean * lean).sqrt();
        let [b, d] = [[lean * up, up], [first, 0.0]];
        let c = [b[0] + d[0], b[1] + d[1]];
        [
            libm::hypot(c[0], c[1]),
            libm::hypot(d[0] - b[0], d[1] - b[1]),
            first,
        ]
    }

    #[test]
    fn the_lean_is_that_of_the_parallelogram_whichever_its_sides() {
        for (first, second, slant) in [
            (100.0, 100.0, 2e-3),
            (120.0, 80.0, -5e-3),
            (90.0, 100.0, 0.0),
        ] {
            let found = lean(lengths(first, second, slant)).unwrap();
            assert!((found - slant).abs() < 1e-12, "{found} {slant}");
        }
        // The longer diagonal goes from A: the angle there is less than a right one.
        assert!(lean([141.51, 141.32, 100.0]).unwrap() > 0.0);
        for bad in [
            [141.0, 141.0, 300.0],
            [0.0, 141.0, 100.0],
            [180.0, 90.0, 100.0],
            // A slip of a digit, and a diagonal in place of a side.
            [141.32, 150.51, 100.0],
            [141.32, 141.51, 141.4],
        ] {
            assert!(lean(bad).is_err());
        }
    }

    #[test]
    fn the_parameters_of_a_machine_make_it_lean_as_measured_while_x_and_the_bed_stay() {
        let own = printer([[0.0, 235.0], [0.0, 235.0], [0.0, 250.0]]);
        // The bed moves along Y, and Z carries X.
        let y = own.find("[[axis]]").unwrap();
        let [x, z] = ["name = \"X\"", "name = \"Z\""].map(|n| own.find(n).unwrap() - 9);
        let spindle = own.find("[spindle]").unwrap();
        let bed = own[y..x].replace("\"tool\"", "\"workpiece\"\nreversed = true");
        let slinger = [
            &own[..y],
            &bed,
            &own[z..spindle],
            &own[x..z],
            &own[spindle..],
        ]
        .concat();
        let router = include_str!("../../../../examples/router/machine.toml").to_owned();
        for (text, by_bed) in [(router, false), (own, false), (slinger, true)] {
            let machine = Machine::from_toml(&text).unwrap();
            let wanted = [1.5e-3, -0.8e-3, 2.0e-3];
            let mut errors = ErrorModel::perfect(&machine);
            for (plane, lean) in wanted.into_iter().enumerate() {
                for (name, value) in parameters(&machine, plane, lean).unwrap() {
                    assert!(errors.set(&machine, Parameter::parse(name).unwrap(), value));
                }
            }
            let found = directions(&machine, &errors).unwrap();
            let [by_x, by_y] = match by_bed {
                true => [wanted[0], 0.0],
                false => [0.0, wanted[0]],
            };
            let expected = [
                [1.0, by_x, 0.0],
                [by_y, 1.0, 0.0],
                [wanted[1], wanted[2], 1.0],
            ];
            for (found, expected) in found.iter().flatten().zip(expected.iter().flatten()) {
                // Parameters add up in pairs: 1.5e-3 times 2e-3.
                assert!(
                    (found - expected).abs() < 5e-6,
                    "{text}\n{found} {expected}"
                );
            }
        }
    }
}
