//! Finds rows, balls, indexed positions and styli that do not fit the others: data snooping as in geodesy (Baarda),
//! one suspect at a time, each with the hypothesis that explains it.

use super::Unknown;
use super::identified::Identified;
use super::rows::{Problem, Weights};
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use trueaxis_model::errors::{Parameter, ParameterKind};

/// A suspected deviation from the file.
#[derive(Clone, Debug, PartialEq)]
pub enum Suspect {
    /// One probing.
    Row,
    /// A ball that has moved.
    Ball(String),
    /// A stylus that was bent or changed.
    Stylus,
    /// A position (deg) at which this rotary axis was not where it reported.
    Index(char, f64),
    /// A reported angle (deg) at which the spindle was not.
    Spindle(f64),
}

/// A suspect, and the displacement with which it would fit the others.
#[derive(Clone, Debug, PartialEq)]
pub struct Suspicion {
    /// The suspect.
    pub suspect: Suspect,
    /// The rows of the file concerned, by index.
    pub rows: Vec<usize>,
    /// Displacement (mm): of the tip from the ball in the workpiece frame, or of the stylus in the spindle frame.
    /// For an indexed position, the angle about its axis (rad) in the first component.
    pub off: Vector3<f64>,
    /// Standard uncertainty of its length (mm or rad).
    pub uncertainty: f64,
    /// Another ball that the row would fit, if any.
    pub other_ball: Option<String>,
}

/// Hypotheses are accepted beyond this many standard deviations of a normal distribution: one wrong one in ten
/// million. A thousand good files with ten thousand hypotheses each give one false alarm.
const CRITICAL: f64 = 5.2;
/// A hypothesis about a group must explain this fraction of the residuals (sums of squares). A model that lacks
/// something also makes groups significant, but they explain little.
const EXPLAINS: f64 = 0.5;
/// The fraction of a hypothesis' effect that the unknowns must not be able to absorb.
const TESTABLE: f64 = 1e-3;
/// A row belongs to another ball if it fits it this well (mm).
const OTHER_BALL: f64 = 1.0;
/// Largest fraction of the rows that are suspected one by one; more are not exceptions.
const MOST: f64 = 0.2;
/// Rotary positions (deg) that differ by less are equal.
const SAME: f64 = 1e-3;

/// Finds what does not fit the others.
///
/// A row is tested by the F-test of its three coordinates (the counterpart of the w-test of one), a group by that of
/// its unknowns. The hypothesis with the largest likelihood, penalized by its number of unknowns (Schwarz), is
/// accepted; then the next one is searched.
#[must_use]
pub fn snoop(problem: &Problem<'_>, identified: &Identified) -> Vec<Suspicion> {
    let mut adjusted = Adjusted::new(problem, identified);
    let groups = groups(problem, &adjusted.stylus);
    let mut found = Vec::new();
    let most = (problem.places.len() as f64 * MOST).ceil() as usize;
    while found.len() < most {
        let Some(best) = adjusted.best(problem, &groups) else {
            break;
        };
        adjusted.take(&best, &groups);
        found.push(best.suspicion(problem, identified));
    }
    found
}

/// Displacement of the tip in some of the places: a column for each unknown of a hypothesis.
struct Group {
    suspect: Suspect,
    /// Places in the order in which they were probed.
    places: Vec<usize>,
    /// The effect in each place: 3 × unknowns, in mm.
    effects: Vec<DMatrix<f64>>,
    /// True if every tail of the places is a hypothesis of its own: a change from then on.
    is_from: bool,
}

/// The hypothesis that explains most.
struct Best {
    suspect: Suspect,
    places: Vec<usize>,
    change: DVector<f64>,
    uncertainty: f64,
    gain: f64,
}

impl Best {
    fn suspicion(self, problem: &Problem<'_>, identified: &Identified) -> Suspicion {
        let off = Vector3::from_fn(|k, _| self.change.get(k).copied().unwrap_or(0.0));
        let mut rows: Vec<usize> = self.places.iter().map(|i| problem.places[*i].row).collect();
        rows.sort_unstable();
        let other_ball = match (&self.suspect, &self.places[..]) {
            (Suspect::Row, [place]) => {
                let own = problem.places[*place].ball;
                let tip = identified.balls[own] + off;
                let mut others = identified.balls.iter().zip(&problem.balls).enumerate();
                let other =
                    others.find(|(i, (ball, _))| *i != own && (tip - *ball).norm() < OTHER_BALL);
                other.map(|(_, (_, name))| name.clone())
            }
            _ => None,
        };
        Suspicion {
            suspect: self.suspect,
            rows,
            off,
            uncertainty: self.uncertainty,
            other_ball,
        }
    }
}

/// An adjustment and its residuals.
struct Adjusted {
    /// Orthonormal columns: the space that the unknowns can absorb.
    basis: DMatrix<f64>,
    /// Residuals in units of stated standard uncertainties (or mm).
    left: DVector<f64>,
    freedom: usize,
    /// Inverse standard uncertainty of each place (1/mm).
    weights: Vec<f64>,
    /// Derivative of the tip by the stylus in each place.
    stylus: Vec<Matrix3<f64>>,
    equations: usize,
}

impl Adjusted {
    /// With all rows weighted as stated, without robust weights.
    fn new(problem: &Problem<'_>, identified: &Identified) -> Self {
        let is_stated = identified.of_stated.is_some();
        let rows: Vec<f64> = (problem.places.iter())
            .map(|place| {
                place
                    .sigma
                    .filter(|_| is_stated)
                    .unwrap_or(identified.noise)
                    .recip()
            })
            .collect();
        let weights = Weights {
            rows,
            least: identified.place.weights.least,
        };
        let estimate = &identified.place.estimate;
        let unknowns = identified.place.factor.unknowns();
        let unknowns: Vec<Unknown> = unknowns.iter().map(|i| problem.unknowns[*i]).collect();
        let mut jacobian = problem.derivatives(&unknowns, estimate, &weights);
        // Columns of very different lengths would be taken for dependent.
        for mut column in jacobian.column_iter_mut() {
            let length = column.norm();
            if length > 0.0 {
                column /= length;
            }
        }
        let basis = jacobian.qr().q();
        let residuals = problem.residuals(estimate, &weights);
        let left = &residuals - &basis * basis.tr_mul(&residuals);
        let unit = Weights {
            rows: vec![1.0; problem.places.len()],
            least: weights.least,
        };
        let stylus = problem.derivatives(&[0, 1, 2].map(Unknown::Stylus), estimate, &unit);
        let stylus = (0..problem.places.len()).map(|i| stylus.fixed_view::<3, 3>(3 * i, 0).into());
        Self {
            freedom: left.len().saturating_sub(basis.ncols()),
            equations: left.len(),
            basis,
            left,
            weights: weights.rows,
            stylus: stylus.collect(),
        }
    }

    /// The hypothesis that explains most, if it is significant.
    fn best(&self, problem: &Problem<'_>, groups: &[Group]) -> Option<Best> {
        let mut best: Option<Best> = None;
        let mut offer = |suspect: &Suspect, places: &[usize], tested: Option<Tested>| {
            let Some(tested) = tested else { return };
            if best.as_ref().is_none_or(|best| tested.gain > best.gain) {
                best = Some(Best {
                    suspect: suspect.clone(),
                    places: places.to_vec(),
                    change: tested.change,
                    uncertainty: tested.uncertainty,
                    gain: tested.gain,
                });
            }
        };
        for place in 0..problem.places.len() {
            let mut sums = Sums::new(self, 3);
            sums.add(self, place, &DMatrix::identity(3, 3));
            offer(&Suspect::Row, &[place], sums.tested(self, false));
        }
        for group in groups {
            let mut sums = Sums::new(self, group.effects[0].ncols());
            for (k, place) in group.places.iter().enumerate().rev() {
                sums.add(self, *place, &group.effects[k]);
                // A single row is tested as a row, and all rows of a ball or stylus are just its position.
                let is_hypothesis = match group.is_from {
                    true => k > 0 && group.places.len() - k > 1,
                    false => k == 0,
                };
                if is_hypothesis {
                    offer(&group.suspect, &group.places[k..], sums.tested(self, true));
                }
            }
        }
        best
    }

    /// The columns of a hypothesis, in units of standard uncertainties.
    fn columns(&self, best: &Best, groups: &[Group]) -> DMatrix<f64> {
        let mut columns = DMatrix::zeros(self.left.len(), best.change.len());
        let group = groups.iter().find(|group| group.suspect == best.suspect);
        for place in &best.places {
            let effect = group.and_then(|group| {
                let k = group.places.iter().position(|p| p == place)?;
                Some(group.effects[k].clone())
            });
            let effect = effect.unwrap_or_else(|| DMatrix::identity(3, 3)) * self.weights[*place];
            columns.rows_mut(3 * place, 3).copy_from(&effect);
        }
        columns
    }

    /// Accepts a hypothesis.
    fn take(&mut self, best: &Best, groups: &[Group]) {
        let mut columns = self.columns(best, groups);
        columns -= &self.basis * self.basis.tr_mul(&columns);
        // Twice is enough: the first pass leaves rounding.
        columns -= &self.basis * self.basis.tr_mul(&columns);
        let new = columns.qr().q();
        self.left -= &new * new.tr_mul(&self.left);
        self.freedom = self.freedom.saturating_sub(new.ncols());
        let (old, count) = (self.basis.ncols(), new.ncols());
        let basis = std::mem::replace(&mut self.basis, DMatrix::zeros(0, 0));
        self.basis = basis.insert_columns(old, count, 0.0);
        self.basis.columns_mut(old, count).copy_from(&new);
    }
}

/// The sums that a test of a hypothesis needs, over its places.
struct Sums {
    /// The columns in the basis, the products of the columns with each other, and with the residuals.
    in_basis: DMatrix<f64>,
    normal: DMatrix<f64>,
    gradient: DVector<f64>,
}

/// A significant hypothesis.
struct Tested {
    change: DVector<f64>,
    uncertainty: f64,
    /// Logarithm of its likelihood, minus the penalty for its unknowns.
    gain: f64,
}

impl Sums {
    fn new(adjusted: &Adjusted, count: usize) -> Self {
        Self {
            in_basis: DMatrix::zeros(adjusted.basis.ncols(), count),
            normal: DMatrix::zeros(count, count),
            gradient: DVector::zeros(count),
        }
    }

    fn add(&mut self, adjusted: &Adjusted, place: usize, effect: &DMatrix<f64>) {
        let effect = effect * adjusted.weights[place];
        self.in_basis += adjusted.basis.rows(3 * place, 3).tr_mul(&effect);
        self.normal += effect.tr_mul(&effect);
        self.gradient += effect.tr_mul(&adjusted.left.rows(3 * place, 3));
    }

    fn tested(&self, adjusted: &Adjusted, is_group: bool) -> Option<Tested> {
        let count = self.gradient.len();
        if adjusted.freedom <= count {
            return None;
        }
        let free = &self.normal - self.in_basis.tr_mul(&self.in_basis);
        // The part that the unknowns absorb cannot be tested.
        let whole = self.normal.trace() / count as f64;
        let least = free.symmetric_eigenvalues().min();
        if least.is_nan() || least < TESTABLE * whole {
            return None;
        }
        let inverse = free.try_inverse()?;
        let change = &inverse * &self.gradient;
        let explained = change.dot(&self.gradient);
        let all = adjusted.left.norm_squared();
        let rest = (all - explained).max(f64::MIN_POSITIVE);
        let freedom = adjusted.freedom - count;
        let ratio = explained / count as f64 / (rest / freedom as f64);
        let is_explained = !is_group || explained > EXPLAINS * all;
        if !is_explained || deviations(ratio, count, freedom) < CRITICAL {
            return None;
        }
        let equations = adjusted.equations as f64;
        let unit = &change / change.norm();
        Some(Tested {
            uncertainty: ((unit.transpose() * &inverse * &unit)[0] * rest / freedom as f64).sqrt(),
            gain: 0.5 * freedom as f64 * (all / rest).ln() - 0.5 * count as f64 * equations.ln(),
            change,
        })
    }
}

/// The number of standard deviations of a normal distribution that are as unlikely as this F (Paulson).
fn deviations(f: f64, count: usize, freedom: usize) -> f64 {
    let [one, other] = [count, freedom].map(|n| 2.0 / (9.0 * n as f64));
    let root = f.cbrt();
    ((1.0 - other) * root - (1.0 - one)) / (other * root * root + one).sqrt()
}

/// Hypotheses about more than one row.
fn groups(problem: &Problem<'_>, stylus: &[Matrix3<f64>]) -> Vec<Group> {
    let places = &problem.places;
    let mut probed: Vec<usize> = (0..places.len()).collect();
    probed.sort_by_key(|i| places[*i].row);
    let dynamic = |m: &Matrix3<f64>| DMatrix::from_column_slice(3, 3, m.as_slice());
    let mut groups = Vec::new();
    let mut add = |suspect, places: Vec<usize>, effect: &dyn Fn(usize) -> DMatrix<f64>, is_from| {
        if places.len() > 1 {
            groups.push(Group {
                effects: places.iter().map(|i| effect(*i)).collect(),
                suspect,
                places,
                is_from,
            });
        }
    };
    let of = |is_in: &dyn Fn(usize) -> bool| -> Vec<usize> {
        probed.iter().copied().filter(|i| is_in(*i)).collect()
    };
    for (ball, name) in problem.balls.iter().enumerate() {
        let rows = of(&|i| places[i].ball == ball);
        add(
            Suspect::Ball(name.clone()),
            rows,
            &|_| DMatrix::identity(3, 3),
            true,
        );
    }
    // The displacement that is missing at the tip.
    let at_stylus = |i: usize| -dynamic(&stylus[i]);
    add(Suspect::Stylus, probed.clone(), &at_stylus, true);
    let machine = problem.machine;
    for (i, axis) in machine.axes.iter().enumerate() {
        if !axis.letter.is_rotary() {
            continue;
        }
        let own = Unknown::Parameter(Parameter {
            component: axis.letter.component() + 3,
            axis: axis.letter.char(),
            kind: ParameterKind::Degree(0),
        });
        let unit = Weights {
            rows: vec![1.0; places.len()],
            least: 1.0,
        };
        let turn = problem.derivatives(&[own], &problem.start(), &unit);
        let turn = |i: usize| -turn.rows(3 * i, 3).into_owned();
        let position = |place: usize| digits(axis.to_command(places[place].q[i]));
        for value in values(probed.iter().map(|p| position(*p))) {
            let rows = of(&|place| (position(place) - value).abs() < SAME);
            // Nothing is known about an axis that does not move.
            if rows.len() < probed.len() {
                add(
                    Suspect::Index(axis.letter.char(), value),
                    rows,
                    &turn,
                    false,
                );
            }
        }
    }
    let angles = values(probed.iter().map(|p| places[*p].spindle));
    for angle in angles.iter().skip(1) {
        let rows = of(&|place| (places[place].spindle - angle).abs() < SAME);
        add(Suspect::Spindle(*angle), rows, &at_stylus, false);
    }
    groups
}

/// A position rounded as in a file: without rounding errors from radians.
fn digits(position: f64) -> f64 {
    (position * 1e6).round() / 1e6
}

/// The distinct values.
fn values(all: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut values: Vec<f64> = all.collect();
    values.sort_by(f64::total_cmp);
    values.dedup_by(|a, b| (*a - *b).abs() < SAME);
    values
}

impl Suspicion {
    /// True if it concerns more than one row.
    #[must_use]
    pub fn is_group(&self) -> bool {
        self.suspect != Suspect::Row
    }

    /// A sentence about it: suspect, size and remedy.
    #[must_use]
    pub fn sentence(&self, problem: &Problem<'_>) -> String {
        let line = |row: usize| {
            let place = problem.places.iter().find(|place| place.row == row);
            place.map_or(0, |place| place.line)
        };
        let first = self.rows.first().map_or(0, |row| line(*row));
        // A deviation of a millimetre or more is a mistake, not a machine error.
        let (unit, factor) = if self.off.norm() < 1.0 {
            ("µm", 1e3)
        } else {
            ("mm", 1.0)
        };
        let by = format!(
            "{:.1} ± {:.1} {unit} (k = 2)",
            self.off.norm() * factor,
            2.0 * self.uncertainty * factor
        );
        let [x, y, z]: [f64; 3] = (self.off * factor).into();
        let off = format!("x {x:.1}, y {y:.1}, z {z:.1}");
        match &self.suspect {
            Suspect::Row => match &self.other_ball {
                Some(ball) => format!(
                    "line {first} looks like a probing of ball {ball}: it is {:.1} mm from where the other rows put its ball; correct the name, or leave it out with --without \"line {first}\"",
                    self.off.norm()
                ),
                None => format!(
                    "line {first}: the tip is {by} from where the other rows put it ({off}); look at its readings, leave it out with --without \"line {first}\", or use --robust"
                ),
            },
            Suspect::Ball(name) => format!(
                "ball {name} has moved by {by} ({off}) before line {first}: look whether it is loose, and leave it out with --without \"ball {name}\", or give it another name from line {first} on"
            ),
            Suspect::Stylus => format!(
                "the stylus has moved by {by} ({off}, in the spindle) before line {first}: look whether it is bent, loose or another one, and identify the rows from line {first} on by themselves"
            ),
            Suspect::Index(axis, position) => format!(
                "at {axis} = {position}, {axis} was off by {:.1} ± {:.1} µrad (k = 2): look at its clamping and its scale, or leave these {} rows out with --without \"{axis} = {position}\"",
                self.off.x * 1e6,
                2.0 * self.uncertainty * 1e6,
                self.rows.len()
            ),
            Suspect::Spindle(angle) => format!(
                "at a spindle angle of {angle}° the stylus is {by} ({off}, in the spindle) from where it should be: look whether the spindle was oriented, or leave these {} rows out with --without \"S = {angle}\"",
                self.rows.len()
            ),
        }
    }
}
