//! Whether anything meets anything else on the way of a strategy.

use super::candidates::Setup;
use super::scene::{Meeting, Scene, Way, is_described};
use super::steps::Step;
use crate::formats::probings::Probings;
use trueaxis_model::machine::PerAxis;

/// A move on which two solids would come too close.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("on the way to or from ball {ball} (line {line} of the strategy) {meeting}")]
pub struct Collision {
    /// Line of the row to which the move belongs.
    pub line: usize,
    /// The ball of that row.
    pub ball: String,
    /// What meets what.
    pub meeting: Meeting,
}

/// A machine on its way through steps.
#[derive(Clone, Debug)]
pub(super) struct Course<'a> {
    setup: &'a Setup<'a>,
    scene: Scene<'a>,
    /// Where each axis is (mm, deg), if that is known.
    at: Vec<Option<f64>>,
}

impl<'a> Course<'a> {
    /// Somewhere.
    pub fn new(setup: &'a Setup<'a>) -> Self {
        Self {
            setup,
            scene: Scene::new(setup.machine, setup.artefact, &setup.probe, 0.0),
            at: vec![None; setup.machine.axes.len()],
        }
    }

    /// Makes a step; returns how the machine moves on it, if that is known.
    pub fn go(&mut self, step: &Step) -> Option<Move<'a>> {
        let Setup {
            machine,
            artefact,
            probe,
            ..
        } = self.setup;
        let (to, way) = match step {
            Step::Row(_) => return None,
            Step::Orient(angle) => {
                self.scene = Scene::new(machine, artefact, probe, *angle);
                let here = self.position()?;
                return Some(Move {
                    scene: Scene::turning(machine, artefact, probe),
                    ends: [here; 2],
                    way: Way::Far,
                });
            }
            Step::Rapid(to) => (to, Way::Far),
            Step::Near(to) => (to, Way::Near),
            Step::Touch { end, .. } => (end, Way::Touch),
        };
        let (from, before) = (self.position(), self.at.clone());
        for (axis, position) in to {
            self.at[*axis] = Some(*position);
        }
        let end = self.position();
        // After a touch the stylus goes back the same way.
        if way == Way::Touch {
            self.at = before;
        }
        Some(Move {
            scene: self.scene.clone(),
            ends: [from?, end?],
            way,
        })
    }

    fn position(&self) -> Option<PerAxis> {
        let mut position = PerAxis::default();
        for (position, at) in position.iter_mut().zip(&self.at) {
            *position = (*at)?;
        }
        Some(position)
    }

    /// True if nothing meets on these steps, which belong to a ball.
    pub fn is_clear(&self, steps: &[Step], ball: &str) -> bool {
        let mut course = self.clone();
        let moves = |step| course.go(step);
        !steps
            .iter()
            .filter_map(moves)
            .any(|one| one.meeting(ball).is_some())
    }
}

/// A move, or a turn of the spindle.
pub(super) struct Move<'a> {
    scene: Scene<'a>,
    ends: [PerAxis; 2],
    way: Way,
}

impl Move<'_> {
    /// What meets on it, while this ball is probed.
    pub fn meeting(&self, ball: &str) -> Option<Meeting> {
        let [from, to] = &self.ends;
        self.scene.meeting(ball, self.way, from, to)
    }
}

/// The first move of `steps`, which are those of `strategy`, on which anything comes closer than [`Probe::keep`] to
/// anything on the other side: tool, stylus and shank, against table, balls and posts; what stands still against both.
/// From balls a stylus keeps nine tenths of the clearance of touches, for they may stand beside their places; near the
/// ball that is touched it only must not touch it. The machine is taken to have no errors, and all axes to start and stop
/// together. Moves before the first row, and whatever is not described, are not known.
///
/// [`Probe::keep`]: super::Probe::keep
#[must_use]
pub fn collision(setup: &Setup<'_>, strategy: &Probings, steps: &[Step]) -> Option<Collision> {
    let (row, meeting) = first(setup, strategy, steps)?;
    let row = &strategy.rows[row];
    Some(Collision {
        line: row.line,
        ball: strategy.balls[row.ball].clone(),
        meeting,
    })
}

/// The row to which the first such move belongs.
fn first(setup: &Setup<'_>, strategy: &Probings, steps: &[Step]) -> Option<(usize, Meeting)> {
    let mut course = Course::new(setup);
    let mut row = 0;
    for step in steps {
        if let Step::Row(number) = step {
            row = *number;
        }
        let ball = &strategy.balls[strategy.rows.get(row)?.ball];
        if let Some(meeting) = course.go(step).and_then(|one| one.meeting(ball)) {
            return Some((row, meeting));
        }
    }
    None
}

/// The first row of a strategy that cannot be reached clear of what is described.
pub(super) fn obstructed(setup: &Setup<'_>, strategy: &Probings) -> Option<usize> {
    if !is_described(setup.machine, setup.artefact) {
        return None;
    }
    let steps = super::steps::steps(setup, strategy).ok()?;
    first(setup, strategy, &steps).map(|(row, _)| row)
}
