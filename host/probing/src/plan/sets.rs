//! Named position sets, by which the source document calibrates and validates.
//!
//! *Chase-the-ball* follows one ball through rotary positions (Bringmann and Knapp 2006; Table 5-4). *RUMBA* probes
//! every ball of an artefact without known lengths at the same positions (Table 5-3). *SAMBA* adds a scale bar,
//! turns the spindle, and at each position probes the balls that are accessible (Table 4-1). The lists are those of
//! the document for its machines; for other machines they are scaled to their two rotary axes.

use super::candidates::Setup;
use super::touches::Unreachable;
use std::fmt;
use trueaxis_identify::formats::probings::{self, Probing, Probings};
use trueaxis_model::machine::{Branch, MAX_AXES, Machine};
use trueaxis_model::source::FileError;

/// A position set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Set {
    /// One ball, followed through 60 rotary positions.
    ///
    /// Table 5-4.
    ChaseTheBall,
    /// Every ball at 42 rotary positions.
    ///
    /// Table 5-3.
    Rumba,
    /// A bar and master balls at 32 rotary positions, with an indexed spindle.
    ///
    /// Table 4-1.
    Samba,
}

impl Set {
    /// Name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::ChaseTheBall => "chase-the-ball",
            Self::Rumba => "rumba",
            Self::Samba => "samba",
        }
    }

    /// Largest angle (deg) between the stylus and the direction in which a ball stands off the table, if the set
    /// needs another default: SAMBA turns the table by a quarter.
    #[must_use]
    pub fn cone(self) -> Option<f64> {
        (self == Self::Samba).then_some(90.0)
    }

    /// The document's list, with the indices of the tilting and the turning axis on its own machine.
    fn listed(self) -> Result<(Probings, [usize; 2]), FileError> {
        let (machine, text, tilts) = match self {
            Self::ChaseTheBall => (KOLIBRI, include_str!("sets/kolibri-validation.csv"), 'A'),
            Self::Rumba => (KOLIBRI, include_str!("sets/kolibri-plan.csv"), 'A'),
            Self::Samba => (HU40, include_str!("sets/hu40-plan.csv"), 'B'),
        };
        let machine = Machine::from_toml(machine)?;
        let listed = probings::read(text, &machine, false)?;
        let axes = [tilts, 'C'].map(|letter| machine.index(letter).unwrap_or_default());
        Ok((listed, axes))
    }
}

// Links, because a published crate has no other folders than its own.
const KOLIBRI: &str = include_str!("sets/kolibri-machine.toml");
const HU40: &str = include_str!("sets/hu40-machine.toml");

impl fmt::Display for Set {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A position set on a machine.
#[derive(Clone, Debug)]
pub struct SetPositions {
    /// The probings, in the order of the document.
    pub plan: Probings,
    /// Rows of the set that cannot be probed: ball, row and reason.
    pub left_out: Vec<(String, Probing, Unreachable)>,
}

/// Why a set cannot be used on a machine or with an artefact.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{what}")]
pub struct SetError {
    what: String,
    remedy: &'static str,
}

impl SetError {
    fn new(what: impl Into<String>, remedy: &'static str) -> Self {
        let what = what.into();
        Self { what, remedy }
    }

    /// What to do about the error.
    #[must_use]
    pub fn remedy(&self) -> &'static str {
        self.remedy
    }
}

/// Positions of scaled axes are rounded to tenths of a degree.
const TENTHS: f64 = 10.0;
/// Values this close to one count as one: rounding.
const NEAR: f64 = 1e-12;
const TURN: f64 = 360.0;

/// A set for a machine and its artefact, without the rows that the stylus or an axis cannot reach.
///
/// The tilting axis goes as far as in the document, or proportionally less if its travel on a side is smaller. The
/// turning axis, the one with the larger travel, takes the same angles, shifted by whole turns if its travel is
/// smaller.
///
/// # Errors
/// [`SetError`].
pub fn positions(setup: &Setup<'_>, set: Set) -> Result<SetPositions, SetError> {
    let own = rotary(setup.machine, set)?;
    let (listed, listed_axes) = (set.listed())
        .map_err(|error| SetError::new(error.message, "this is an error of the program"))?;
    let axes = ListedAxes::new(own, listed_axes, &listed);
    let mut found = SetPositions {
        plan: Probings {
            balls: setup.balls.clone(),
            rows: Vec::new(),
        },
        left_out: Vec::new(),
    };
    for (ball, row) in of_balls(setup, set, &listed)? {
        let mut row = axes.taken(setup, ball, &row);
        match setup.touching(&row) {
            Err(reason) => found
                .left_out
                .push((setup.balls[ball].clone(), row, reason)),
            // Shifted by whole turns, two positions of the document can coincide.
            Ok(_) if found.plan.rows.iter().any(|r| is_same(r, &row)) => {}
            Ok(_) => {
                row.line = found.plan.rows.len() + 2;
                found.plan.rows.push(row);
            }
        }
    }
    if found.plan.rows.is_empty()
        && let Some((ball, _, reason)) = found.left_out.first()
    {
        return Err(SetError::new(
            format!("nothing of {set} can be probed: ball {ball}: {reason}"),
            "correct the balls' nominal_mm and away_from_table, or allow more with --cone",
        ));
    }
    Ok(only_used(found))
}

/// The tilting axis, then the turning axis: in the machine and in a list, and from where to where they go in the list.
struct ListedAxes {
    own: [usize; 2],
    listed: [usize; 2],
    extents: [[f64; 2]; 2],
}

impl ListedAxes {
    fn new(own: [usize; 2], listed: [usize; 2], list: &Probings) -> Self {
        let extent = |axis: usize| {
            let all = list.rows.iter().map(|row| row.position[axis]);
            all.fold([0.0_f64; 2], |[low, high], p| [low.min(p), high.max(p)])
        };
        Self {
            own,
            listed,
            extents: listed.map(extent),
        }
    }

    /// A row of the list as the machine takes it.
    fn taken(&self, setup: &Setup<'_>, ball: usize, row: &Probing) -> Probing {
        let machine = setup.machine;
        let ([tilts, turns], [tilt_extent, turn_extent]) = (self.own, self.extents);
        let [tilt, turn] = self.listed.map(|axis| row.position[axis]);
        let mut taken = Probing {
            ball,
            position: [0.0; MAX_AXES],
            direction: [0.0; MAX_AXES],
            ..row.clone()
        };
        taken.position[tilts] = scaled(tilt, tilt_extent, machine.axes[tilts].travel);
        taken.position[turns] = turned(turn, turn_extent, machine, turns);
        for (own, listed) in self.own.into_iter().zip(self.listed) {
            taken.direction[own] = row.direction[listed];
            if !setup.can_come(&taken, own) {
                taken.direction[own] = 0.0;
            }
        }
        taken
    }
}

fn is_same(a: &Probing, b: &Probing) -> bool {
    (a.ball, a.spindle) == (b.ball, b.spindle)
        && a.position == b.position
        && a.direction == b.direction
}

/// Names of the balls that are probed, in order of appearance.
fn only_used(mut found: SetPositions) -> SetPositions {
    let mut balls: Vec<String> = Vec::new();
    for row in &mut found.plan.rows {
        row.ball = probings::ball_index(&mut balls, &found.plan.balls[row.ball]);
    }
    found.plan.balls = balls;
    found
}

/// The tilting axis and the turning axis.
fn rotary(machine: &Machine, set: Set) -> Result<[usize; 2], SetError> {
    let all: Vec<usize> = (0..machine.axes.len())
        .filter(|i| machine.axes[*i].letter.is_rotary())
        .collect();
    let [a, b] = all[..] else {
        return Err(SetError::new(
            format!(
                "{set} turns balls with two rotary axes: {} has {}",
                machine.name,
                all.len()
            ),
            "leave --set out: a measurement plan is then proposed for this machine",
        ));
    };
    let travel = |i: usize| {
        let axis = &machine.axes[i];
        match axis.modulo {
            true => f64::INFINITY,
            false => axis.travel[1] - axis.travel[0],
        }
    };
    // If both have the same travel, the one nearer to the workpiece turns: axes of its branch are listed outwards.
    let is_outer = machine.axes[b].branch != Branch::Workpiece;
    let a_turns = travel(a) > travel(b) || travel(a) == travel(b) && is_outer;
    Ok(if a_turns { [b, a] } else { [a, b] })
}

/// A position, reduced proportionally if the travel does not allow the whole range on its side.
fn scaled(position: f64, [least, most]: [f64; 2], [low, high]: [f64; 2]) -> f64 {
    let part = match position > 0.0 {
        true => (high / most).clamp(0.0, 1.0),
        false if position < 0.0 => (low / least).clamp(0.0, 1.0),
        false => 1.0,
    };
    let moved = match part < 1.0 {
        // Rounded towards zero, so that it stays inside.
        true => (position * part * TENTHS * (1.0 + NEAR)).trunc() / TENTHS,
        false => position,
    };
    moved.clamp(low, high)
}

/// This angle inside the travel, if possible.
fn turned(position: f64, extent: [f64; 2], machine: &Machine, axis: usize) -> f64 {
    let axis = &machine.axes[axis];
    let [low, high] = axis.travel;
    if axis.modulo {
        return (position - low).rem_euclid(TURN) + low;
    }
    let same = [0.0, -TURN, TURN].map(|turn| position + turn);
    let inside = same.into_iter().find(|p| (low..=high).contains(p));
    inside.unwrap_or_else(|| scaled(position, extent, [low, high]))
}

/// The rows of the list for the balls of the artefact: the index of a ball of the setup, and a row.
fn of_balls(
    setup: &Setup<'_>,
    set: Set,
    listed: &Probings,
) -> Result<Vec<(usize, Probing)>, SetError> {
    let first = || listed.rows.iter().filter(|row| row.ball == 0);
    match set {
        Set::ChaseTheBall if setup.balls.len() > 1 => Err(SetError::new(
            format!("chase-the-ball follows one ball, not {}", setup.balls.len()),
            "name one ball with --balls, or use --set rumba",
        )),
        Set::ChaseTheBall | Set::Rumba => Ok((0..setup.balls.len())
            .flat_map(|ball| first().map(move |row| (ball, row.clone())))
            .collect()),
        Set::Samba => {
            let (bar, masters) = samba_balls(setup)?;
            // In the list, the balls of the bar are 1 and 2.
            let ball = |row: &Probing| -> Option<usize> {
                let number: usize = listed.balls[row.ball].parse().ok()?;
                match number.checked_sub(1)? {
                    at @ (0 | 1) => Some(bar[at]),
                    at => masters.get(at - 2).copied(),
                }
            };
            let rows = listed.rows.iter();
            Ok(rows
                .filter_map(|row| Some((ball(row)?, row.clone())))
                .collect())
        }
    }
}

/// The balls of the bar, and the others.
fn samba_balls(setup: &Setup<'_>) -> Result<([usize; 2], Vec<usize>), SetError> {
    let index = |name: &String| setup.balls.iter().position(|b| b == name);
    let bar = setup.artefact.bars.iter().find_map(|bar| {
        let [one, other] = &bar.balls;
        Some([index(one)?, index(other)?])
    });
    let bar = bar.ok_or_else(|| {
        SetError::new(
            "samba needs a bar, and the artefact has none",
            "write [[bar]] with balls, length_mm and standard_uncertainty_mm, or use --set rumba",
        )
    })?;
    let masters: Vec<usize> = (0..setup.balls.len())
        .filter(|b| !bar.contains(b))
        .collect();
    if masters.is_empty() {
        return Err(SetError::new(
            "samba needs master balls in addition to the two of the bar",
            "write [[ball]] with name and nominal_mm for each, or name them with --balls",
        ));
    }
    Ok((bar, masters))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_stay_inside_smaller_travels_in_proportion() {
        let extent = [-55.0, 55.0];
        assert_eq!(scaled(55.0, extent, [-120.0, 120.0]), 55.0);
        assert_eq!(scaled(55.0, extent, [-120.0, 30.0]), 30.0);
        assert_eq!(scaled(-55.0, extent, [-120.0, 30.0]), -55.0);
        // 20 of 55 scaled to 30: 10.909, rounded towards zero.
        assert!((scaled(20.0, extent, [-120.0, 30.0]) - 10.9).abs() < 1e-12);
        // An axis that does not reach the other side stays at its end.
        assert_eq!(scaled(-20.0, extent, [5.0, 90.0]), 5.0);
    }
}
