//! What is said of an outlier.

use super::{Outlier, OutlierKind};
use crate::instrument::Kind;
use crate::rows::Problem;

impl Outlier {
    /// A sentence about it: which, its size and a remedy.
    #[must_use]
    pub fn sentence(&self, problem: &Problem<'_>) -> String {
        let (first, count) = (self.first_line(problem), self.rows.len());
        let (by, off) = self.displacement();
        match (&self.kind, self.observations.first()) {
            (OutlierKind::Row | OutlierKind::Setup(_), Some(number)) => {
                self.of_observation(problem, *number)
            }
            (OutlierKind::Setup(name), _) => format!("the set-up {name} has moved"),
            (OutlierKind::Reading(name, one), _) => format!(
                "the readings of {name} look {}: everything else fits if their deviations are multiplied by {:.3} ± {:.3} (k = 2); correct them, or leave them out with --without \"setup {name}\"",
                one.what,
                1.0 - self.off.x,
                2.0 * self.uncertainty
            ),
            (OutlierKind::Row, _) => match &self.other_ball {
                Some(ball) => format!(
                    "line {first} looks like a probing of ball {ball}: it is {:.1} mm from where the other rows put its ball; correct the name, or leave it out with --without \"line {first}\"",
                    self.off.norm()
                ),
                None => format!(
                    "line {first}: the tip is {by} from where the other rows put it ({off}); look at its readings, leave it out with --without \"line {first}\", or use --robust"
                ),
            },
            (OutlierKind::Ball(name), _) => format!(
                "ball {name} has moved by {by} ({off}) before line {first}: look whether it is loose, and leave it out with --without \"ball {name}\", or give it another name from line {first} on"
            ),
            (OutlierKind::Stylus, _) => format!(
                "the stylus has moved by {by} ({off}, in the spindle) before line {first}: look whether it is bent, loose or another one, and identify the rows from line {first} on by themselves"
            ),
            (OutlierKind::Index(axis, position), _) => format!(
                "at {axis} = {position}, {axis} was off by {:.1} ± {:.1} µrad (k = 2): look at its clamping and its scale, or leave these {count} rows out with --without \"{axis} = {position}\"",
                self.off.x * 1e6,
                2.0 * self.uncertainty * 1e6
            ),
            (OutlierKind::Spindle(angle), _) => format!(
                "at a spindle angle of {angle}° the stylus is {by} ({off}, in the spindle) from where it should be: look whether the spindle was oriented, or leave these {count} rows out with --without \"S = {angle}\""
            ),
        }
    }

    /// The line of the first probing, or 0.
    fn first_line(&self, problem: &Problem<'_>) -> usize {
        let row = self.rows.first();
        let place = row.and_then(|row| problem.places.iter().find(|place| place.row == *row));
        place.map_or(0, |place| place.line)
    }

    /// The displacement of a tip with its uncertainty, and its coordinates.
    fn displacement(&self) -> (String, String) {
        // A deviation of a millimetre or more is a mistake, not a machine error.
        let (unit, factor) = if self.off.norm() < 1.0 {
            ("µm", 1e3)
        } else {
            ("mm", 1.0)
        };
        // Micrometres tell both from 0.
        let digits = if factor == 1.0 { 3 } else { 1 };
        let by = format!(
            "{:.digits$} ± {:.digits$} {unit} (k = 2)",
            self.off.norm() * factor,
            2.0 * self.uncertainty * factor
        );
        let [x, y, z]: [f64; 3] = (self.off * factor).into();
        let off = format!("x {x:.digits$}, y {y:.digits$}, z {z:.digits$}");
        (by, off)
    }

    /// A sentence about an observation, or about a set-up from this observation on.
    fn of_observation(&self, problem: &Problem<'_>, number: usize) -> String {
        let observed = &problem.observed;
        let row = &observed.rows[number];
        let (file, line) = (&observed.files[row.file], row.line);
        // A scalar has a sign.
        let off = match row.kind.dimension() {
            1 => self.off.x,
            _ => self.off.norm(),
        };
        let (unit, factor) = match row.kind {
            Kind::Angle => ("µrad", 1e3),
            _ if off.abs() < 1.0 => ("µm", 1e3),
            _ => ("mm", 1.0),
        };
        let by = format!(
            "{:.1} ± {:.1} {unit} (k = 2)",
            off * factor,
            2.0 * self.uncertainty * factor
        );
        match &self.kind {
            OutlierKind::Setup(name) => format!(
                "{file} line {line}: from here on, {name} reads {by} too much: look whether it has moved or slipped, and give it another name in the column setup from this line on"
            ),
            _ => format!(
                "{file} line {line}: this {} is {by} from what the other rows say; look at the reading, leave it out with --without \"{file} line {line}\", or use --robust",
                row.kind.name()
            ),
        }
    }
}
