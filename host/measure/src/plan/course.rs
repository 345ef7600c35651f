//! A machine on its way through the steps of a plan.

use super::candidates::Setup;
use super::scene::{Meeting, Scene, Way};
use super::step::ProbingStep;
use trueaxis_model::machine::PerAxis;

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
    pub fn go(&mut self, step: &ProbingStep) -> Option<CourseMove<'a>> {
        let Setup {
            machine,
            artefact,
            probe,
            ..
        } = self.setup;
        let (to, way) = match step {
            ProbingStep::Row(_) => return None,
            ProbingStep::Orient(angle) => {
                self.scene = Scene::new(machine, artefact, probe, *angle);
                let here = self.position()?;
                return Some(CourseMove {
                    scene: Scene::turning(machine, artefact, probe),
                    ends: [here; 2],
                    way: Way::Far,
                });
            }
            ProbingStep::Rapid(to) => (to, Way::Far),
            ProbingStep::Near(to) => (to, Way::Near),
            ProbingStep::Touch { end, .. } => (end, Way::Touch),
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
        Some(CourseMove {
            scene: self.scene.clone(),
            ends: [from?, end?],
            way,
        })
    }

    /// Makes several steps.
    pub fn follow(&mut self, steps: &[ProbingStep]) {
        for step in steps {
            self.go(step);
        }
    }

    fn position(&self) -> Option<PerAxis> {
        let mut position = PerAxis::default();
        for (position, at) in position.iter_mut().zip(&self.at) {
            *position = (*at)?;
        }
        Some(position)
    }

    /// True if nothing meets on these steps, which belong to a ball.
    pub fn is_clear(&self, steps: &[ProbingStep], ball: &str) -> bool {
        let mut course = self.clone();
        let moves = |step| course.go(step);
        !(steps.iter())
            .filter_map(moves)
            .any(|one| one.meeting(ball).is_some())
    }
}

/// A move, or a turn of the spindle.
pub(super) struct CourseMove<'a> {
    scene: Scene<'a>,
    ends: [PerAxis; 2],
    way: Way,
}

impl CourseMove<'_> {
    /// What meets on it, while this ball is probed.
    pub fn meeting(&self, ball: &str) -> Option<Meeting> {
        let [from, to] = &self.ends;
        self.scene.meeting(ball, self.way, from, to)
    }
}
